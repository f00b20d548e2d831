"""The site of these pages, built by `make docs`, which adds the Rust API as the folder `rust`.

The source is the whole repository, so that a link means on the site what it means in the files: to another page, or
to a file, which is then copied. Warnings are errors, so that a link to nothing ends the build.
"""

import re
from pathlib import Path

from sphinx.errors import ExtensionError

ROOT = Path(__file__).parents[1]

project = "Palpate"
copyright = "Palpate's authors"
version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
html_title = f"Palpate {version}"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "docs/README"
include_patterns = ["*.md", "docs/*.md", "experiments/README.md", "models/SOURCE.md", "models/*/SOURCE.md"]
# Not searched: what is built, fetched or run.
exclude_patterns = [".*", "target", "runs", "python"]

html_theme = "furo"
html_copy_source = False
html_show_sphinx = False
# index.html, which leads to the guide.
html_extra_path = ["site"]
html_static_path = ["static"]
html_css_files = ["site.css"]

myst_heading_anchors = 4
# Guides abbreviate: `key = […]` is no TOML.
suppress_warnings = ["misc.highlighting_failure"]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
# `like this` in a docstring.
default_role = "code"

# The sidebar beside the pages that the index links in its lists, which a forge shows without a sidebar.
PROJECT = ["../README", "../models/SOURCE", "../models/pa10/SOURCE"]


def contents(index):
    """The sidebar: for each section of the index, the pages that its list links."""
    for title, text in re.findall(r"^## (.*)\n((?:(?!## ).*\n?)*)", index, re.MULTILINE):
        items = "\n".join(line for line in text.splitlines() if line.startswith("- "))
        pages = re.findall(r"\]\(([^)#]+)\.md\)", items)
        if pages:
            yield title, pages
    yield "The project", PROJECT


# The command for the Rust API in the index, and the link that replaces it: the site contains the API.
RUST_COMMAND = "Rust by `cargo doc --no-deps --open`"
RUST_LINK = '<a href="../rust/palpate/index.html">Rust</a>'


def add_contents(app, docname, source):
    """Links the Rust API from the index, and appends the sidebar."""
    if docname == root_doc:
        if RUST_COMMAND not in source[0]:
            raise ExtensionError(f"{docname} lacks the text {RUST_COMMAND}")
        source[0] = source[0].replace(RUST_COMMAND, RUST_LINK)
        for title, pages in contents(source[0]):
            source[0] += "\n".join(["\n```{toctree}", ":hidden:", f":caption: {title}", *pages, "```\n"])


# Docstrings of attributes as they are written, by name.
WRITTEN = {}


def keep_attribute(app, what, name, obj, options, lines):
    """Notes what napoleon would read as `TYPE: TEXT` wherever it holds a colon."""
    if what in ("attribute", "data", "property"):
        WRITTEN[name] = list(lines)


def restore_attribute(app, what, name, obj, options, lines):
    """Puts it back."""
    if what in ("attribute", "data", "property"):
        lines[:] = WRITTEN[name]


# HTML of Sphinx and the theme, and its replacement with roles and names that screen readers need, and with code and
# tables that the keyboard scrolls.
ACCESSIBLE = {
    'class="caption" role="heading"': 'class="caption" role="heading" aria-level="2"',
    '<aside class="sidebar-drawer"': '<aside class="sidebar-drawer" aria-label="Site"',
    '<aside class="toc-drawer"': '<aside class="toc-drawer" aria-label="This page"',
    '<aside class="toc-drawer no-toc"': '<aside class="toc-drawer no-toc" aria-label="This page"',
    '<div id="search-results">': '<h1>Search</h1><div id="search-results">',
    "<pre>": '<pre tabindex="0">',
    '<div class="table-wrapper': '<div tabindex="0" class="table-wrapper',
}


def make_accessible(app, exception):
    """Applies `ACCESSIBLE` to all pages; one that no page needs is an error."""
    unused = set(ACCESSIBLE)
    for path in Path(app.outdir).rglob("*.html") if exception is None else ():
        page = path.read_text()
        for old, new in ACCESSIBLE.items():
            if old in page or new in page:
                unused.discard(old)
                page = page.replace(new, old).replace(old, new)
        path.write_text(page)
    if exception is None and unused:
        raise ExtensionError(f"no page contains {sorted(unused)}; correct ACCESSIBLE in docs/conf.py")


def setup(app):
    """Called by Sphinx."""
    app.connect("build-finished", make_accessible)
    app.connect("source-read", add_contents)
    app.connect("autodoc-process-docstring", keep_attribute, priority=400)  # napoleon has 500
    app.connect("autodoc-process-docstring", restore_attribute, priority=600)
