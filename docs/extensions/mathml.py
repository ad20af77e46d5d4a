"""Formulae as MathML, which browsers draw without a script: nothing is fetched when a page is read."""

import re

from docutils import nodes
from latex2mathml.converter import convert

_INFINITY, _MINUS = "&#x0221E;", "&#x02212;"
_PRIMED = re.compile(r"<msup><mi>(\w)</mi><m[io]>(&#x0203[234];)</m[io]></msup>")
_FUNCTION = re.compile(r"<m[io]>(arctan|asinh|cos|exp|ln|log|sgn|sin|tanh)</m[io]>(?!<mo[^>]*>&#x00028;)")
_SIGN = re.compile(rf"(<mo[^>]*>&#x0(?:003D|2264|2265|003E|003C|002C|0028);</mo>)<mo>{_MINUS}")


def mathml(latex: str, display: str = "inline") -> str:
    """MathML of a formula, with the spaces that TeX sets and the converter leaves out.

    A prime is high in its font already, so it is no exponent. A minus behind a relation or a bracket is a sign.
    """
    text = convert(latex, display=display)
    text = _PRIMED.sub(r'<mi>\1</mi><mo lspace="0" rspace="0">\2</mo>', text)
    text = _SIGN.sub(rf'\1<mo form="prefix">{_MINUS}', text)
    text = _FUNCTION.sub(r'<mo form="prefix" lspace="0.17em" rspace="0.17em">\1</mo>', text)
    return text.replace(f"<mo>{_INFINITY}</mo>", f"<mi>{_INFINITY}</mi>")


def _inline(self, node):
    self.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _block(self, node):
    self.body.append(f'<div class="math">{mathml(node.astext(), "block")}</div>')
    raise nodes.SkipNode


def setup(app):
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
