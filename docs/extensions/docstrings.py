"""Docstrings as Sphinx reads them: |w| is no substitution, prose after a section no entry of it, what returns no type."""

import re


def _prepare(*given):
    what, lines = given[1], given[-1]
    if what == "property":  # napoleon would take what stands before a colon for a type
        lines[:1] = [line.replace(": ", " – ", 1) for line in lines[:1]]
    lines[:] = _returns(_sections([_moduli(line) for line in lines]))


def _moduli(line):
    if line.lstrip().startswith((">>>", "...")):
        return line
    parts = re.split(r"(``.*?``)", line)
    return "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def _sections(lines):
    """Name the paragraphs that follow a section: examples, or notes on limits and sources."""
    found, section = [], ""
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        if line and re.fullmatch(r"-{3,}", after):
            section = line
        elif section and line and not line[0].isspace() and found and not found[-1]:
            title = "Examples" if line.startswith(">>>") else "Notes"
            if title != section:
                found += [title, "-" * len(title)]
                section = title
        found.append(line)
    return found


def _returns(lines):
    """Sentences on what a function returns as the text of an entry without name and type, which they are not."""
    found, inside = [], False
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        header = bool(re.fullmatch(r"-{3,}", after))
        inside = (inside and not header) or (line == "Returns" and header)
        if inside and re.fullmatch(r"-{3,}", line):
            found += [line, ":"]
        else:
            found.append(f"    {line}" if inside and line and not header else line)
    return found


def setup(app):
    """Run before napoleon, which reads the sections."""
    app.connect("autodoc-process-docstring", _prepare, priority=100)
    return {"parallel_read_safe": True}
