"""The directive ``command-line``: every sub-command with its options, from the parser of the command line itself."""

import argparse

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from stickslip.cli.main import _parser


class CommandLine(SphinxDirective):
    """One section for each sub-command: what it does, how it is called, its options."""

    def run(self) -> list[nodes.Node]:
        """Make the sections."""
        commands = next(action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
        about = {choice.dest: choice.help or "" for choice in commands._choices_actions}
        return [self._section(name, command, about[name]) for name, command in commands.choices.items()]

    def _section(self, name: str, command: argparse.ArgumentParser, about: str) -> nodes.section:
        section = nodes.section(ids=[f"stickslip-{name}"], names=[f"stickslip {name}"])
        section += nodes.title("", f"stickslip {name}")
        section += nodes.paragraph("", f"{about[:1].upper()}{about[1:]}.")
        usage = command.format_usage().removeprefix("usage: ")
        section += nodes.literal_block(usage, usage, language="text")
        options = nodes.definition_list()
        for action in command._actions:
            if isinstance(action, argparse._HelpAction):
                continue
            term = nodes.term()
            term += nodes.literal("", _called(action))
            meaning = nodes.definition("", nodes.paragraph("", _help(command, action)))
            options += nodes.definition_list_item("", term, meaning)
        section += options
        if command.epilog:
            section += nodes.literal_block(command.epilog, command.epilog, language="text")
        return section


def _called(action: argparse.Action) -> str:
    name = action.metavar or (action.dest.upper() if action.nargs != 0 and not action.choices else "")
    if isinstance(name, tuple):
        name = " ".join(name)
    if action.choices:
        name = "{" + ",".join(map(str, action.choices)) + "}"
    many = " ..." if action.nargs in ("+", "*") else ""
    return ", ".join(f"{flag} {name}{many}".strip() for flag in action.option_strings) or f"{name}{many}"


def _help(command: argparse.ArgumentParser, action: argparse.Action) -> str:
    return command._get_formatter()._expand_help(action) if action.help else ""


def setup(app):
    """Register the directive."""
    app.add_directive("command-line", CommandLine)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
