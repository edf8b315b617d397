"""Menus hold every command once, in parts short enough to read."""

from app.window.all_commands import all_commands
from app.window.menus import PARTS, rows_of
from tools.registry import Registry

MOST = 26  # rows of a menu, at 24 pixels each, on a screen of 1080 with room for the lines between


def test_every_command_stands_once_in_a_menu_of_few_rows():
    commands = [command.name for command in all_commands(Registry(()))]
    for category in {name.split(".")[0] for name in commands}:
        names = [name for name in commands if name.split(".")[0] == category]
        rows = rows_of(category, names)
        assert sorted(name for row in rows for name in row.names) == sorted(names)
        shown = sum(1 if row.title else len(row.names) for row in rows)
        assert shown <= MOST, (category, shown)
        assert all(len(row.names) <= MOST for row in rows)
        assert {f"{category}.{part.first}" for part in PARTS.get(category, ())} <= set(names), category


def test_what_no_part_begins_with_stands_first_or_with_what_is_before_it():
    rows = rows_of("frame", ["frame.new_one", "frame.play", "frame.next", "frame.begin_here"])
    assert [row.names for row in rows] == [("frame.new_one",), ("frame.play", "frame.next"), ("frame.begin_here",)]
