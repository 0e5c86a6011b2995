"""The page of all commands, from the program itself."""

from typing import Any

import typer

from gne_mj.cli import app


def commands_page() -> str:
    """What stands for the mark ``<!-- commands -->``."""
    group: Any = typer.main.get_command(app)
    parts = []
    for name, command in sorted(group.commands.items()):
        arguments = [each for each in command.params if each.param_type_name == "argument"]
        options = [each for each in command.params if each.param_type_name == "option"]
        shown = [_metavar(each) if each.required else f"[{_metavar(each)}]" for each in arguments]
        line = " ".join(["gne-mj", name, *shown, *["[OPTIONS]"] * bool(options)])
        parts += [f"## {name}\n", f"`{line}`\n", _text(command.help), ""]
        parts += _table("argument", [(f"`{_metavar(each)}`", each) for each in arguments])
        parts += _table("option", [(_flags(each), each) for each in options])
    return "\n".join(parts)


def _table(of: str, rows: list[tuple[str, Any]]) -> list[str]:
    if not rows:
        return []
    lines = [f"| {of} | default | |", "|---|---|---|"]
    for shown, each in rows:
        cells = [shown, _default(each), _text(each.help)]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return [*lines, ""]


def _metavar(parameter: Any) -> str:
    return str(parameter.metavar or parameter.name.upper()).strip("[]")


def _flags(option: Any) -> str:
    flags = ", ".join(f"`{each}`" for each in option.opts)
    if option.is_flag:
        return flags
    kind = option.type_descriptor.annotation
    return f"{flags} `{option.metavar or getattr(kind, '__name__', str(kind)).upper()}`"


def _default(parameter: Any) -> str:
    value = parameter.default
    nothing = value is None or value is False or value in ("", [], ()) or parameter.required
    return "" if nothing or callable(value) else f"`{value}`"


def _text(help_: str | None) -> str:
    return " ".join((help_ or "").replace("\f", " ").split())
