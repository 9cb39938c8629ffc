"""Arguments that messages of the library name are options on the command line."""

import ast
from pathlib import Path

import pytest
import typer

import bingham
from bingham.cli.main import app
from bingham.cli.reading import OPTIONS
from bingham.cli.wording import AXES, in_options, worded
from bingham.errors import InvalidArgumentError, RecordingError, RecordingWarning, Setting

# The commands that read recordings, and those of axes, with what their options are called.
COMMANDS = {"track": OPTIONS, "tune": OPTIONS, "calibrate": OPTIONS, "cluster": AXES}
OF_AXES = ("io/axes.py", "io/field_notes.py", "distributions/")
SOURCE = Path(bingham.__file__).parent


def settings():
    """Return the file and argument of every setting in the library whose argument stands in the call."""
    found = set()
    for path in sorted(SOURCE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Setting":
                first = node.args[0]
                names = [first.body, first.orelse] if isinstance(first, ast.IfExp) else [first]
                where = path.relative_to(SOURCE).as_posix()
                found |= {(where, name.value) for name in names if isinstance(name, ast.Constant)}
    return sorted(found)


def test_every_setting_that_a_message_names_has_an_option():
    found = settings()
    assert len(found) >= 15
    for where, argument in found:
        table = AXES if where.startswith(OF_AXES) else OPTIONS
        assert argument in table, f"{where}: {argument} has no option"


@pytest.mark.parametrize("name", COMMANDS)
def test_the_options_are_those_of_the_commands(name):
    there = {option for p in typer.main.get_command(app).commands[name].params for option in p.opts}
    for option in COMMANDS[name].values():
        assert option.partition(" ")[0] in there


@pytest.mark.parametrize(
    ("setting", "python", "option"),
    [
        (Setting("units", {"time": "ms"}), "units={'time': 'ms'}", "--unit time=ms"),
        (
            Setting("columns", {"gx": "Gyro X", "gy": "it's"}),
            """columns={'gx': 'Gyro X', 'gy': "it's"}""",
            """--column 'gx=Gyro X' --column 'gy=it'"'"'s'""",
        ),
        (Setting("columns", ["t", "ax", "-"]), "columns=['t', 'ax', '-']", "--columns t,ax,-"),
        (Setting("regularise", True), "regularise=True", "--regularise"),
        (Setting("rate"), "rate=", "--rate"),
        (Setting("max_size", 2_000_000), "max_size=2000000", "--max-size 2000000"),
        (Setting("pose_topic"), "pose_topic=", "--topic pose=TOPIC"),
        (Setting("pose_topic", "/tf:A.B"), "pose_topic='/tf:A.B'", "--topic pose=/tf:A.B"),
        (Setting("stamps"), "stamps=", "stamps"),
    ],
)
def test_settings_are_spelled_for_python_and_for_the_command_line(setting, python, option):
    warning = RecordingWarning("a.csv", "doubtful; ", setting, " helps")
    assert str(warning) == f"a.csv: doubtful; {python} helps"
    assert str(worded(warning, OPTIONS)) == f"a.csv: doubtful; {option} helps"
    with pytest.raises(RecordingError) as error, in_options(OPTIONS):
        raise RecordingError("a.csv", "line 1", "wrong", ("give ", setting))
    assert str(error.value) == f"a.csv: line 1: wrong; give {option}"


def test_what_stands_in_prose_stays_and_an_argument_becomes_its_option():
    with pytest.raises(InvalidArgumentError) as error, in_options(OPTIONS):
        raise InvalidArgumentError("units", "no max_size=3 in a file", "units={'time': 'ms'}", "see rate=")
    assert str(error.value) == "--unit: expected no max_size=3 in a file, got units={'time': 'ms'}; see rate="


def test_hints_are_data():
    error = RecordingError("a.csv", "", "poses without times", ("give ", Setting("rate"), " in Hz"))
    assert error.hint[1] == Setting("rate")
    assert str(error) == "a.csv: poses without times; give rate= in Hz"
