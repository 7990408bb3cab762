import ast
import json
from pathlib import Path

from selflock.diagnosis.judge.gain import Gain
from selflock.diagnosis.judge.result import Diagnosis
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.rules.__main__ import page

ROOT = Path(__file__).parents[3]


def test_a_rule_says_what_it_means_and_where_it_came_from():
    rules = RULES.listed()
    assert len(rules) > 300
    assert not [one.name for one in rules if len(one.meaning) <= 10 or len(one.origin) <= 5]
    assert not [one.name for one in rules if "|" in one.meaning + one.origin]  # of a table


def test_the_page_is_that_of_the_rules():
    made = page()
    assert (ROOT / "docs/rules.md").read_text() == made, "make it again: python -m selflock.diagnosis.rules > docs/rules.md"
    assert all(made.count(f"| `{name}` |") == 1 for name in RULES.by_name())


def test_a_diagnosis_carries_the_rules_that_it_was_made_with():
    gain = Gain("", "", 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, [])
    told = Diagnosis("none", [], [], [], gain, {}).data()["rules"]
    assert told == json.loads(json.dumps(RULES.by_name())) and told["search.relevant"] == RULES.search.relevant


ELSEWHERE = {  # what decides nothing
    "judge/result.py": {"EXIT"},  # codes of the command
    "search/hypotheses.py": {"SIDES"},  # places in a tuple
    "pipeline/chance.py": {"LEVELS"},  # quantiles that are told
    "output/figures.py": {"STYLE"},
    "output/traces.py": {"BEFORE", "AFTER", "MEASURED"},  # colours
    "output/report.py": {"QUARTER", "NEAR", "TOLD"},  # which words are said, and how many
    "data/balances.py": {"INERTIAS", "MASSES"},  # units
    "data/motions.py": {"RPM", "DEGREE", "TURN", "SLIPS", "METRES"},  # units and how slips of them are called
    "data/lifting.py": {"SLIPS"},  # units
    "data/rig.py": {"SHARES"},
    "data/table.py": {
        "LARGEST",
        "LARGEST_JSON",
        "LARGEST_PACKED",
        "LARGEST_BOOK",
        "COMPRESSED",
        "PIECE",
    },  # how much of a stranger's file is read
    "data/scales.py": {"DEGREE", "ARCMIN", "SLIPS", "MILLI"},  # units and how slips of them are called
    "data/structures.py": {"WIDEST", "DEEPEST", "MOST_NAMES", "LONGEST"},
    "data/text.py": {"LOOKED_AT", "LINES", "ALIKE", "MOST_COLUMNS"},
    "data/wrapped.py": {"PERIODS"},  # units, and the counts that encoders have
    "systems/sanity.py": {"SLIPS", "KELVIN"},  # units and how slips of them are called
    "begin/guess.py": {"RPM", "DEG", "TURN", "FACTORS", "SLIPS", "ROUND"},  # units, and the counts that encoders have
    "begin/numbers.py": {"NONE"},
    "begin/raw.py": {"SECONDS", "EPOCHS", "BEYOND", "MOST_LISTED"},
    "begin/write.py": {"WIDTH"},
    "calibration/page.py": {"ROWS", "COLUMNS"},  # how much is drawn
    "naming/page.py": {"ROWS", "POINTS"},
    "calibration/played.py": {"SAME", "OTHER", "CHANCE"},  # codes of what a process answers
    "naming/outcome.py": {"EXIT"},
    "naming/guesses.py": {"FAR", "PLAIN", "DERIVED", "PAIRS"},  # beyond all numbers; names of stages
    "naming/kernels.py": {"SIGNAL", "X", "W", "OUT", "P"},  # places in a block
    "naming/places.py": {"MIDDLE"},  # a half of a step
    "residuals/free_law.py": {"IN_LOOP"},  # a code of the loops
    "systems/parts.py": {"CLOSE"},  # digits of a time
    "tracking/changes.py": {"NORMAL"},  # a quantile of what is told
    "tracking/logs.py": {"STARS"},  # how much of a stranger's pattern is looked at
    "tracking/page.py": {"UNITS", "POINTS", "ROWS", "COLOURED", "SECONDS"},  # how much is drawn
    "tracking/track.py": {"EXIT", "TOLD"},
}


def numbers(node: ast.expr) -> bool:
    """Whether a value has a number in it, the places of a subscript and the insides of functions apart."""
    if isinstance(node, (ast.Subscript, ast.Lambda)):
        return isinstance(node, ast.Subscript) and numbers(node.value)
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    return any(numbers(child) for child in ast.iter_child_nodes(node))


def constants(path: Path) -> set[str]:
    """Names of a module that are given a number as it is loaded, outside functions and classes."""
    found = set()
    for node in ast.parse(path.read_text()).body:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        if targets and node.value is not None and numbers(node.value):
            found |= {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return found


def test_no_number_that_steers_stands_outside_the_rules():
    room = ROOT / "diagnosis"
    paths = [path for path in sorted(room.rglob("*.py")) if room / "rules" not in path.parents]
    found = {str(path.relative_to(room)): names for path in paths if (names := constants(path))}
    assert len(paths) > 30 and found == ELSEWHERE, "a number that steers the diagnosis belongs into diagnosis/rules/"


def test_every_rule_is_used():
    text = "".join(path.read_text() for path in sorted((ROOT / "diagnosis").rglob("*.py")) if path.parent.name != "rules")
    assert not [name for name in RULES.by_name() if f".{name.partition('.')[2]}" not in text]
