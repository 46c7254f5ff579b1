"""Commands that the studio starts, each a process of its own."""

from airborne.studio.commands import Command


def test_two_commands_of_one_kind_say_each_its_own(tmp_path):
    commands = [Command(["export", name, "--c3d"], tmp_path) for name in ("no_run", "no_other")]
    for command in commands:
        assert command.output() == ""
        command._process.wait()
    assert ["no_run" in each.complaint() for each in commands] == [True, False]
    assert "no_other" in commands[1].complaint()
