"""Formulas as MathML, which browsers draw by themselves, in a font beside the pages: no script, no picture, no web."""

import shutil
from importlib.resources import files
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert

FONT = "STIXTwoMath-Regular.ttf"


def setup(app):
    """Offer the renderer; `html_math_renderer = "mathml"` chooses it."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    app.connect("build-finished", _bring_font)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _inline(writer, node):
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _block(writer, node):
    writer.body.append(f'<div class="formula">{convert(node.astext(), display="block")}</div>\n')
    raise nodes.SkipNode


def _bring_font(app, failed):
    if failed is None and app.builder.format == "html":
        shutil.copyfile(str(files("ziamath") / "fonts" / FONT), Path(app.outdir) / "_static" / FONT)
