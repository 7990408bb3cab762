"""A hidden plant: what stands in for a real drive when the diagnosis is tested.

It shares no formula and no integrator with the product: friction is a bristle (Dahl) instead of exact
stick, laws have other shapes than the vocabulary's, time runs in steps at least twenty times finer than the log's.

    drive.py       what can be hidden, as data
    physics.py     what it does: motor, wedge gear, load, controller, sensors
    forms.py       nature's forms of friction, contact and armature, drawn at random
    causes.py      what can be hidden in it: one entry for each row of the vocabulary, and things outside it
    outside.py     more things outside it
    faults.py      what can be wrong with the recording
    bench.py       set-points that excite everything, logs and rig files on disk, the strength of a cause: one fixed recorder
    recorder.py    how a drive is recorded, drawn at random
    recordings.py  hidden drives of other forms behind such a recorder
"""
