"""Commands that the studio starts, each a process of its own."""

from airborne.studio.commands import Command


def test_two_commands_of_one_kind_say_each_its_own(tmp_path):
    commands = [Command(["export", name, "--c3d"], tmp_path) for name in ("no_run", "no_other")]
    for command in commands:
        assert command.output() == ""
        command._process.wait()
    assert ["no_run" in each.complaint() for each in commands] == [True, False]
    assert "no_other" in commands[1].complaint()
    commands[0]._log.write_text("airborne: compiling\ntracking cross: a throw: 3 of 34\n")
    assert (commands[0].how_far(), commands[0].counted()) == ("3 of 34", 3)
    commands[0]._log.write_text("airborne: compiling: up to a minute\n")
    assert (commands[0].how_far(), commands[0].counted()) == ("compiling: up to a minute", 0)
