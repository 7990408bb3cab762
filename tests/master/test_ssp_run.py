"""SSP archives written by hand, as others write them, run with real FMUs and compared with the same system as TOML."""

import zipfile

import numpy as np
import pytest
from typer.testing import CliRunner

from selflock import master
from selflock.cli import app
from selflock.fmus.build import built

HEAD = (
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"'
)
# A motor in a subsystem, whose speed comes in rev/min and whose torque goes out through a gear of ratio 10; the load's
# angle is read in degrees by a sensor whose FMU says nothing of its unit.
STRUCTURE = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {HEAD} version="1.0" name="hoist">
  <ssd:System name="Hoist">
    <ssd:Connectors>
      <ssd:Connector name="supply" kind="input"><ssc:Real unit="mV"/></ssd:Connector>
      <ssd:Connector name="shown" kind="output"><ssc:Real/></ssd:Connector>
    </ssd:Connectors>
    <ssd:ParameterBindings>
      <ssd:ParameterBinding source="hoist.ssv"><ssd:ParameterMapping source="hoist.ssm"/></ssd:ParameterBinding>
      <ssd:ParameterBinding prefix="Drive."><ssd:ParameterValues>
        <ssv:ParameterSet version="1.0" name="drive"><ssv:Parameters>
          <ssv:Parameter name="M.inductance"><ssv:Real value="0.5" unit="mH"/></ssv:Parameter>
        </ssv:Parameters><ssv:Units>
          <ssc:Unit name="mH"><ssc:BaseUnit kg="1" m="2" s="-2" A="-2" factor="0.001"/></ssc:Unit>
        </ssv:Units></ssv:ParameterSet>
      </ssd:ParameterValues></ssd:ParameterBinding>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:System name="Drive">
        <ssd:Connectors>
          <ssd:Connector name="supply" kind="input"><ssc:Real unit="V"/></ssd:Connector>
          <ssd:Connector name="turning" kind="input"><ssc:Real unit="rev/min"/></ssd:Connector>
          <ssd:Connector name="torque" kind="output"><ssc:Real unit="N.m"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:Elements>
          <ssd:Component name="M" source="Motor.fmu"><ssd:Connectors>
            <ssd:Connector name="voltage" kind="input"/><ssd:Connector name="speed" kind="input"><ssc:Real unit="rad/s"/></ssd:Connector>
            <ssd:Connector name="torque" kind="output"/><ssd:Connector name="resistance" kind="parameter"/>
          </ssd:Connectors></ssd:Component>
        </ssd:Elements>
        <ssd:Connections>
          <ssd:Connection startConnector="supply" endElement="M" endConnector="voltage"/>
          <ssd:Connection startConnector="turning" endElement="M" endConnector="speed"/>
          <ssd:Connection startElement="M" startConnector="torque" endConnector="torque">
            <ssc:LinearTransformation factor="10"/></ssd:Connection>
        </ssd:Connections>
      </ssd:System>
      <ssd:Component name="Drum" source="Load.fmu"><ssd:Connectors>
        <ssd:Connector name="torque" kind="input"/><ssd:Connector name="angle" kind="output"/><ssd:Connector name="speed" kind="output"/>
      </ssd:Connectors></ssd:Component>
      <ssd:Component name="Eye" source="Sensor.fmu"><ssd:Connectors>
        <ssd:Connector name="value" kind="input"><ssc:Real unit="deg"/></ssd:Connector><ssd:Connector name="reading" kind="output"/>
      </ssd:Connectors></ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="supply" endElement="Drive" endConnector="supply"/>
      <ssd:Connection startElement="Drum" startConnector="speed" endElement="Drive" endConnector="turning">
        <ssc:LinearTransformation factor="10"/></ssd:Connection>
      <ssd:Connection startElement="Drive" startConnector="torque" endElement="Drum" endConnector="torque"/>
      <ssd:Connection startElement="Drum" startConnector="angle" endElement="Eye" endConnector="value"/>
      <ssd:Connection startElement="Eye" startConnector="reading" endConnector="shown"/>
    </ssd:Connections>
  </ssd:System>
  <ssd:Units>
    <ssc:Unit name="V"><ssc:BaseUnit kg="1" m="2" s="-3" A="-1"/></ssc:Unit>
    <ssc:Unit name="mV"><ssc:BaseUnit kg="1" m="2" s="-3" A="-1" factor="0.001"/></ssc:Unit>
    <ssc:Unit name="N.m"><ssc:BaseUnit kg="1" m="2" s="-2"/></ssc:Unit>
    <ssc:Unit name="rad/s"><ssc:BaseUnit rad="1" s="-1"/></ssc:Unit>
    <ssc:Unit name="rev/min"><ssc:BaseUnit rad="1" s="-1" factor="0.10471975511965977"/></ssc:Unit>
    <ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="0.017453292519943295"/></ssc:Unit>
  </ssd:Units>
  <ssd:DefaultExperiment startTime="0.5" stopTime="1.5"/>
</ssd:SystemStructureDescription>
"""
VALUES = f"""<ssv:ParameterSet {HEAD} version="1.0" name="hoist">
  <ssv:Parameters>
    <ssv:Parameter name="supply"><ssv:Real value="12000" unit="mV"/></ssv:Parameter>
    <ssv:Parameter name="R"><ssv:Real value="400"/></ssv:Parameter>
    <ssv:Parameter name="drum"><ssv:Integer value="2"/></ssv:Parameter>
  </ssv:Parameters>
  <ssv:Units><ssc:Unit name="mV"><ssc:BaseUnit kg="1" m="2" s="-3" A="-1" factor="0.001"/></ssc:Unit></ssv:Units>
</ssv:ParameterSet>"""
MAPPING = f"""<ssm:ParameterMapping {HEAD} version="1.0">
  <ssm:MappingEntry source="supply" target="supply"/>
  <ssm:MappingEntry source="R" target="Drive.M.resistance"><ssc:LinearTransformation factor="0.001"/></ssm:MappingEntry>
  <ssm:MappingEntry source="drum" target="Drum.inertia"><ssc:LinearTransformation factor="0.1" offset="0.05"/></ssm:MappingEntry>
</ssm:ParameterMapping>"""


@pytest.fixture(scope="module")
def hoist(tmp_path_factory):
    path = tmp_path_factory.mktemp("hoist") / "hoist.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in {"SystemStructure.ssd": STRUCTURE, "hoist.ssv": VALUES, "hoist.ssm": MAPPING}.items():
            archive.writestr(name, text)
        for name in ("Motor", "Load", "Sensor"):
            archive.write(built(name), f"{name}.fmu")
    return path


def as_toml():
    """The same by hand in our own words, in the units of the FMUs."""
    return master.from_dict(
        {
            "run": {"start": 0.5, "stop": 1.5, "step": 0.001},
            "components": {
                "Drive/M": {"fmu": "selflock:Motor", "start": {"voltage": 12.0, "resistance": 0.4, "inductance": 0.0005}},
                "Drum": {"fmu": "selflock:Load", "start": {"inertia": 0.25}},
                "Eye": {"fmu": "selflock:Sensor"},
            },
            "connections": {
                "Drive/M.speed": {"from": "Drum.speed", "factor": 10.0},  # rad/s to rev/min, times 10, and back
                "Drum.torque": {"from": "Drive/M.torque", "factor": 10.0},
                "Eye.value": {"from": "Drum.angle", "factor": 180 / np.pi, "convert": False},
            },
        }
    )


def test_a_nested_system_of_others_runs_as_the_same_system_in_our_words(hoist):
    ours, theirs = master.run(as_toml()).table, master.run(hoist).table
    assert list(theirs) == list(ours) and len(theirs) == 1001 and theirs["time"].iloc[0] == 0.5
    assert ours["Drum.angle"].iloc[-1] > 0.5 and ours["Eye.reading"].iloc[-1] == pytest.approx(
        np.degrees(ours["Drum.angle"].iloc[-1])
    )
    for name in ours:
        np.testing.assert_allclose(theirs[name], ours[name], rtol=1e-10, atol=1e-12, err_msg=name)


def test_from_the_command_line_with_other_values(hoist, tmp_path):
    """The names of nested components contain a slash."""
    runner = CliRunner()
    out = tmp_path / "r.csv"
    done = runner.invoke(
        app, ["run", str(hoist), "--set", "Drive/M.resistance=0.8", "--set", "Drive/M.voltage=6", "--stop", "0.7", "-o", str(out)]
    )
    assert done.exit_code == 0, (done.output, done.exception)
    table, units = master.read(out)
    expected = master.run(as_toml(), settings={"Drive/M.resistance": 0.8, "Drive/M.voltage": 6.0}, stop=0.7).table
    np.testing.assert_allclose(table["Drum.speed"], expected["Drum.speed"], rtol=1e-10, atol=1e-12)
    assert units["Drive/M.torque"] == "N.m" and len(table) == 201
    wrong = runner.invoke(app, ["run", str(hoist), "--set", "Drive/N.resistance=0.8", "-o", str(out)])
    assert "no component Drive/N. Did you mean Drive/M?" in str(wrong.exception)


def test_it_can_be_written_again_without_its_hierarchy(hoist, tmp_path):
    again = master.ssp.export(hoist, tmp_path / "flat.ssp")
    assert master.run(again, stop=0.6).table.equals(master.run(hoist, stop=0.6).table)


def test_any_experiment_is_a_whole_number_of_steps(hoist, tmp_path):
    odd = tmp_path / "odd.ssp"
    with zipfile.ZipFile(hoist) as old, zipfile.ZipFile(odd, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b'stopTime="1.5"', b'stopTime="0.51234"'))
    run = master.load(odd).run
    assert run.step <= 1e-3 and (run.stop - run.start) / run.step == pytest.approx(13, abs=1e-9)
    assert master.run(odd).table["time"].iloc[-1] == pytest.approx(0.51234)
