"""The language of Cytosim's configurations: commands, blocks, values, comments, lines; expressions and templates."""

import pytest

from openmm_cylchain.cytosim.arithmetic import evaluate
from openmm_cylchain.cytosim.grammar import Block, ScriptError, read_commands, read_pairs
from openmm_cylchain.cytosim.script import read_script
from openmm_cylchain.cytosim.settings import Settings
from openmm_cylchain.cytosim.templates import expand_template
from openmm_cylchain.errors import InputError

SYSTEM = "set simul system { time_step = 0.01 }\nset space cell { shape = sphere }\nnew cell { radius = 5 }\n"


def pairs(text):
    return [(key, values) for key, values, _ in read_pairs(Block(text, 1))]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = 1", [("a", ["1"])]),
        ("a = 1; b = 2, 3", [("a", ["1"]), ("b", ["2", "3"])]),
        ("a = 1 2 3, 4 5 % why\nb = x", [("a", ["1 2 3", "4 5"]), ("b", ["x"])]),
        ("a = (1 2 3)", [("a", ["1 2 3"])]),
        ("a = ( b=1; c=(2;) ), last", [("a", [" b=1; c=(2;) ".strip(), "last"])]),
        ("a = 1, \\\n 2, \\\n 3", [("a", ["1", "2", "3"])]),
        ("a = 1 \\\n 2", [("a", ["1", "2"])]),
        ('a = "x, y"', [("a", ["x, y"])]),
        ("a = f (g, h)", [("a", ["f (g, h)"])]),
        ("a = (\nnew b { c = 1; }\n)", [("a", ["new b { c = 1; }"])]),
        ("a = 1,", [("a", ["1"])]),
        ("a=\nb=2", [("a", [""]), ("b", ["2"])]),
    ],
)
def test_values_of_settings(text, expected):
    assert pairs(text) == expected


def test_commands_have_their_words_blocks_and_lines():
    text = (
        "/** a file of 2017 { begins\n so */ % a comment { that opens nothing\n"
        "set fiber actin\n{\n a = 1 % no } here\n}\n"
        "%{ a long\n comment { with } brackets\n}\n"
        "new 10 actin ( 1 2 3 )\nnew [2 * volume] actin { b = (c;) }; run 100 system\nrun 5 system { x = 1 }"
    )
    found = [(own.verb, own.words, own.line) for own in read_commands(text)]
    assert found == [
        ("set", ("fiber", "actin"), 3),
        ("new", ("10", "actin"), 10),
        ("new", ("[2 * volume]", "actin"), 11),
        ("run", ("100", "system"), 11),
        ("run", ("5", "system"), 12),
    ]
    first, second, *_ = read_commands(text)
    assert pairs(first.block.text) == [("a", ["1"])]
    assert second.position.text.split() == ["1", "2", "3"]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("set simul s { a = 1", 1, "closes it"),
        ("\n\n{ a = 1 }", 3, "expected a command"),
        ("set simul s\n{\n a 1\n}", 3, 'expected "="'),
        ("set simul s\n{\n 1 = 1\n}", 3, "name of a parameter"),
        ("set simul s { }\nfoo bar", 2, "no command"),
        ("set simul s { time_step = 1 }\nnew 3 bar\nrun 1 s", 2, "nothing called 'bar'"),
        ("set simul s { time_step = 1 }\nrepeat x { }", 2, "repeat needs"),
        ("set simul s { time_step = 1 }\nfor X=1:x { }", 2, "for needs"),
        ("set simul s { time_step = 1 }\nread other.cym", 2, "not beside"),
        ("hello = 1", 1, "no configuration of Cytosim"),
        ("", 1, "no configuration of Cytosim"),
    ],
)
def test_mistakes_have_their_lines(tmp_path, text, line, said):
    path = tmp_path / "my.cym"
    path.write_text(text)
    with pytest.raises(ScriptError, match=rf"^line {line}: .*{said}"):
        script = read_script(path)
        # Mistakes within a block are found when it is read.
        script.simul.number("time_step")


def script_of(tmp_path, text):
    path = tmp_path / "my.cym"
    path.write_text(SYSTEM + text)
    return read_script(path)


def test_repeat_for_and_read_are_followed(tmp_path):
    (tmp_path / "other.cym").write_text("new 5 actin { mark = 1 }")
    script = script_of(
        tmp_path,
        "set fiber actin { rigidity = 1 }\nrepeat 3 { repeat 2 { new 2 actin } }\n"
        "for X=1:4 { new actin { length = [0.5*X+2] } }\nfor X=0:2:5 { new actin { length = [X+1] } }\n"
        "read other.cym\nread missing.cym { required = 0 }\nrun 10 system",
    )
    actin = [own for own in script.created if own.name == "actin"]
    assert [own.count for own in actin] == [2] * 6 + [1] * 6 + [5]
    lengths = [own.settings.number("length") for own in actin if "length" in own.settings]
    assert lengths == [2.5, 3.0, 3.5, 1.0, 3.0, 5.0]


def test_set_and_change_keep_what_they_do_not_give(tmp_path):
    script = script_of(
        tmp_path,
        "set fiber actin { rigidity = 1; confine = inside, 100 }\nset fiber tube { rigidity = 2 }\n"
        "set actin { segmentation = 0.5 }\nchange actin { confine = off }\nchange all fiber { viscosity = 3 }\n"
        "set actin display { color = red }\nset system { kT = 0.004 }\nrun 10 system { nb_frames = 2 }",
    )
    actin, tube = (script.properties[name].settings for name in ("actin", "tube"))
    assert actin.number("segmentation") == 0.5
    assert (actin.text("confine"), actin.number(("confine", 1))) == ("off", 100.0)
    assert [own.number("viscosity") for own in (actin, tube)] == [3.0, 3.0]
    assert script.simul.number("kT") == 0.004
    assert script.stages == []


def test_runs_between_which_nothing_happens_are_one(tmp_path):
    script = script_of(tmp_path, "run 10 system\nreport fiber x.txt\nchange system display { a = 1 }\nrun 20 system")
    assert script.steps == 30
    assert script.stages == []
    script = script_of(tmp_path, "run 1 system { duration = 3 }")
    assert script.steps == 300


PARTS = (
    "set fiber actin { rigidity = 1 }\nset hand grip { binding = 1, 0.1 }\n"
    "set couple link { hand1 = grip; hand2 = grip }\nnew actin\nrun 10 system\n"
    "delete 1 actin { position = inside, box }\nchange actin { rigidity = 2 }\nnew actin\nnew 5 link\n"
    "run 100 system { nb_frames = 2 }\n"
    "change system { time_step = 0.02 }\nnew 4 link { mark = 1 }\nrun 50 system\nreport fiber x\nrun 25 system\n"
    "delete 2 link\nrun 60 system\ndelete link { mark = 1 }\ndelete link { state1 = 0 }\nrun 70 system\n"
    "cut 1 actin { plane = 1 0 0, 0 }\nrun 20 system\n"
)


def test_runs_are_stages_and_apart_where_fibers_come_or_are_cut(tmp_path):
    script = script_of(tmp_path, PARTS)
    every = [script, *script.later]
    assert [own.steps for own in every] == [100, 75, 60, 70]
    assert [own.time_step for own in every] == [0.01, 0.02, 0.02, 0.02]
    assert script.duration == pytest.approx(0.01 * 100 + 0.02 * (75 + 60 + 70))
    assert [own.frames for own in every] == [2, 0, 0, 0]
    links = [sum(new.count for new in own.created if new.name == "link") for own in every]
    # Of those with the mark, the ones that were left; first those that came first.
    assert links == [5, 9, 7, 3]
    assert [own.unbound for own in every] == [{}, {}, {}, {"link": {"state1"}}]
    assert [needs for *_, needs in script.stages] == [
        "stages: filaments that go by where they are, or come and grow"
    ] * 2
    assert [text for _, text, _ in script.stages] == [
        "10 steps of other runs, apart by delete 1 actin",
        "20 steps of other runs, apart by cut 1 actin",
    ]


def test_what_goes_by_where_it_is_is_left_out(tmp_path):
    script = script_of(tmp_path, PARTS.replace("{ state1 = 0 }", "{ position = inside, box }"))
    assert ("stages: linkers that go by where or how they are") in [needs for *_, needs in script.stages]


def test_hundreds_of_runs_are_read_at_once(tmp_path):
    text = "set fiber actin { rigidity = 1 }\nnew actin\nrun 5 system\n"
    text += "repeat 300 { change actin { rigidity = 2 }\nrun 1 system }"
    assert len(script_of(tmp_path, text).later) == 300


def test_settings_know_what_nobody_asked_for():
    settings = Settings.of("fiber a", 1, Block("a = 1\nb = inf, x\nc = 1 2\ndisplay = (z)", 1))
    assert settings.number("missing", "a") == 1.0
    assert settings.number("b") == float("inf")
    assert settings.vector("c") == (1.0, 2.0, 0.0)
    assert settings.number(("b", 2), default=7.0) == 7.0
    assert list(settings.unused()) == []
    settings.set("d", ["5"], 9)
    assert list(settings.unused()) == [("d", ["5"], 9)]
    with pytest.raises(ScriptError, match=r"^line 2: b of fiber a must be a number, but is 'x'"):
        settings.number(("b", 1))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", 7),
        ("2^3", 8),
        ("round(12.0 / 7, 4)", 1.7143),
        ("[1, 10][-1]", 10),
        ("'a' if 1 < 2 else 'b'", "a"),
        ("sqrt(16) + math.cos(0)", 5.0),
        ("range(2, 5)", [2, 3, 4]),
        ("X * 2", 6),
        ("not (1 > 0 and 0)", True),
    ],
)
def test_expressions(text, value):
    assert evaluate(text, {"X": 3}) == value


@pytest.mark.parametrize(
    "text",
    [
        *(
            "__import__('os')",
            "open('x')",
            "(1).__class__",
            "[x for x in [1]]",
            "lambda: 1",
            "Y",
            "1 +",
            "1/0",
            "9**9**9",
        ),
        *("range(10**9)", "'a' * 10**9", "[1] * 9", "random.uniform(0, 1)", "max(default=1)", "(" * 500, "1 in [1]"),
        *("-" * 3000 + "1", "float('x')", "10.0**400", "x\0"),
    ],
)
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(InputError):
        evaluate(text)


def test_templates_take_the_first_of_several_values():
    text = "[[n = range(2, 9)]]\na = [[12 / n]]\nb = [[ [1, 10] ]]\nc = [[['x y', 'z']]]\nd = [[n]]"
    expanded, choices = expand_template(text)
    assert expanded == "\na = 6.0\nb = 1\nc = x y\nd = 2"
    assert [line for line, _ in choices] == [1, 3, 4]
    expanded, choices = expand_template(text, {"n": 4})
    assert expanded.splitlines()[1] == "a = 3.0"
    assert [line for line, _ in choices] == [3, 4]


def test_templates_without_values_are_refused_with_their_lines():
    with pytest.raises(ScriptError, match=r"^line 2: \[\[random.uniform\(0,1\)\]\]: random numbers"):
        expand_template("a\nb = [[random.uniform(0,1)]]")
    with pytest.raises(ScriptError, match="has no values"):
        expand_template("a = [[ [] ]]")
