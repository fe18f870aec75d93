"""Markdown to HTML: tables, anchors, formulas as MathML, code in colour, links as the site has them."""

import re
from collections.abc import Callable
from html import escape

from latex2mathml.converter import convert
from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin
from mdit_py_plugins.dollarmath import dollarmath_plugin
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_by_name
from pygments.util import ClassNotFound


def pygments_css() -> str:
    """Colours of code, light and dark."""
    light = HtmlFormatter(style="friendly").get_style_defs("pre")
    dark = HtmlFormatter(style="github-dark").get_style_defs("pre")
    rules = [line for line in (light, dark) if line]
    light, dark = ("\n".join(line for line in rule.splitlines() if " ." in line) for rule in rules)
    return f"{light}\n@media (prefers-color-scheme: dark) {{\n{dark}\n}}\n"


def slug(text: str) -> str:
    """Anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-")


class Markup:
    """A renderer whose links go through `link`."""

    def __init__(self, link: Callable[[str], str]) -> None:
        self.link = link
        self.parser = MarkdownIt("commonmark", {"highlight": _coloured}).enable("table")
        self.parser.use(anchors_plugin, max_level=4, slug_func=slug)
        self.parser.use(dollarmath_plugin, renderer=_formula, double_inline=True, allow_digits=False)

    def html(self, text: str) -> tuple[str, list[tuple[str, str]]]:
        """HTML of Markdown, and anchor and text of each heading of the second level."""
        tokens = self.parser.parse(text)
        for token in tokens:
            self._relink(token)
        sections = [
            (str(token.attrs["id"]), tokens[at + 1].content.replace("`", ""))
            for at, token in enumerate(tokens)
            if token.type == "heading_open" and token.tag == "h2"
        ]
        html = self.parser.renderer.render(tokens, self.parser.options, {})
        return html.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>"), sections

    def _relink(self, token: Token) -> None:
        for name in ("href", "src"):
            if name in token.attrs:
                token.attrs[name] = self.link(str(token.attrs[name]))
        for child in token.children or []:
            self._relink(child)


def _formula(text: str, options: dict) -> str:
    return convert(text.strip(), display="block" if options["display_mode"] else "inline")


def _coloured(code: str, language: str, more: str) -> str:
    try:
        lexer = get_lexer_by_name(language or "text")
    except ClassNotFound:
        return f"<pre><code>{escape(code)}</code></pre>"
    return f"<pre><code>{highlight(code, lexer, HtmlFormatter(nowrap=True))}</code></pre>\n"
