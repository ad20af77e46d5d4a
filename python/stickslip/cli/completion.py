"""``stickslip completion``: a script that lets a shell complete commands, options and files."""

from __future__ import annotations

import argparse

from stickslip.cli.terminal import Commands, say


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("completion", help="print a script that completes commands and options in a shell")
    command.add_argument("shell", choices=("bash", "zsh", "fish"), help="which shell")
    command.set_defaults(run=lambda options: say(script(options.shell, commands.choices)))


def script(shell: str, commands: dict[str, argparse.ArgumentParser]) -> str:
    """The script for a shell, from the options of every command.

    >>> parser = argparse.ArgumentParser()
    >>> _ = parser.add_argument("--plot")
    >>> print(script("fish", {"simulate": parser}))
    complete -c stickslip -n __fish_use_subcommand -a 'simulate'
    complete -c stickslip -n '__fish_seen_subcommand_from simulate' -l help
    complete -c stickslip -n '__fish_seen_subcommand_from simulate' -l plot
    """
    flags = {name: sorted(_flags(command)) for name, command in commands.items()}
    if shell == "fish":
        lines = [f"complete -c stickslip -n __fish_use_subcommand -a '{' '.join(flags)}'"]
        for name, names in flags.items():
            seen = f"complete -c stickslip -n '__fish_seen_subcommand_from {name}'"
            lines += [f"{seen} -l {flag.removeprefix('--')}" for flag in names]
        return "\n".join(lines)
    cases = "\n".join(f'        {name}) words="{" ".join(names)}" ;;' for name, names in flags.items())
    body = f"""_stickslip() {{
    local cur="${{COMP_WORDS[COMP_CWORD]}}" words=""
    case "${{COMP_WORDS[1]}}" in
{cases}
    esac
    if [ "$COMP_CWORD" -eq 1 ]; then words="{" ".join(flags)}"; fi
    COMPREPLY=($(compgen -W "$words" -- "$cur"))
    if [ "$COMP_CWORD" -gt 1 ]; then COMPREPLY+=($(compgen -f -- "$cur")); fi
}}
complete -o filenames -F _stickslip stickslip"""
    return body if shell == "bash" else f"autoload -U +X bashcompinit && bashcompinit\n{body}"


def _flags(command: argparse.ArgumentParser) -> set[str]:
    return {flag for action in command._actions for flag in action.option_strings if flag.startswith("--")}
