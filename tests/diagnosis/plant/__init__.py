"""A hidden plant: what stands in for a real drive when the diagnosis is tested.

It shares no formula and no integrator with the product: friction is a bristle (Dahl) instead of exact
stick, laws have other shapes than the vocabulary's, time runs in steps at least twenty times finer than the log's.

    drive.py     the physics: motor, wedge gear, load, controller, sensors
    causes.py    what can be hidden in it: one entry for each row of the vocabulary, and things outside it
    faults.py    what can be wrong with the recording
    bench.py     set-points that excite everything, logs and rig files on disk, the strength of a cause
"""
