"""Settings of Sphinx for the site that make_site builds."""
import os
import sys

sys.path.insert(0, os.environ["REFDYN_PYTHON"])
project, copyright, html_title = "Refdyn", "The Refdyn authors", "Refdyn"
extensions = ["myst_parser", "sphinx.ext.autodoc"]
root_doc, exclude_patterns = "README", ["extra", "doctrees"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 5
autodoc_mock_imports, autodoc_member_order = ["refdyn.core"], "bysource"  # the extension is not needed for texts
html_theme, html_extra_path, html_copy_source = "furo", ["extra"], False
pygments_style = "friendly"
suppress_warnings = ["misc.highlighting_failure", "myst.header"]


def shown(app, what, name, obj, options, lines):
    """Docstrings are plain text: the first line is a sentence, and the rest keeps its columns."""
    first, rest = lines[:1], lines[1:]
    lines[:] = [line.replace("_", "\\_").replace("*", "\\*") for line in first]
    if any(line.strip() for line in rest):
        lines += ["", ".. code-block:: none", "", *("    " + line for line in rest)]


def setup(app):
    app.connect("autodoc-process-docstring", shown)
