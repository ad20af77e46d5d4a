"""``stickslip reproduce``: every figure and every claim of the paper, from our model."""

from __future__ import annotations

import argparse

from stickslip.cli.terminal import Bar, Commands, say, say_json, say_written


def add(commands: Commands[argparse.ArgumentParser]) -> None:
    command = commands.add_parser("reproduce", help="the paper's figures and claims from our model, scored")
    command.add_argument(
        "-o",
        "--output",
        metavar="PATH",
        help="folder of the page (paper-report), or file of the search (READING.jsonl)",
    )
    command.add_argument("--json", action="store_true", help="print the scores, or the candidates, as JSON")
    command.add_argument(
        "--search",
        metavar="READING",
        help="search the numbers that the paper leaves open; continues from its file",
    )
    command.add_argument(
        "--candidates", type=int, default=200, metavar="N", help="candidates of the search, those in its file included"
    )
    command.add_argument("--seed", type=int, default=1, help="seed of the search")
    command.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    if options.search is not None:
        _search(options)
        return
    import json

    import pandas as pd

    from stickslip.paper.reproduction import reproduce, summary

    with Bar() as bar:
        page = reproduce(options.output or "paper-report", bar)
    if options.json:
        say_json(json.loads((page.parent / "claims.json").read_text(encoding="utf-8")))
        return
    scores = pd.read_csv(page.parent / "claims.csv", index_col="id")
    for name, verdict in scores["verdict"].items():
        say(f"{name!s:30s}{verdict}")
    say(summary(scores))
    say_written(page)


def _search(options: argparse.Namespace) -> None:
    from pathlib import Path

    from stickslip.paper.calibration import search

    path = Path(options.output or f"{options.search}.jsonl")
    with Bar() as bar:
        found = search(options.search, path, candidates=options.candidates, seed=options.seed, progress=bar)
    if options.json:
        say_json(found.to_dict("records"))
        return
    numbers = found.drop(columns=["reading", "seed", "index", "score", "verdicts"])
    for score, row in zip(found["score"].head(5), numbers.to_dict("records"), strict=False):
        say(f"score {score:.2f}: " + ", ".join(f"{name} {value:.5g}" for name, value in row.items()))
    say_written(path)
