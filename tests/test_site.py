"""The documentation as a site (docs/site/make_site): it needs no network, and every link within it leads somewhere."""
import importlib.util
import re
import subprocess
import sys
import urllib.parse

import pytest

from program import REFDYN, SANITIZED, SOURCE, some

pytestmark = pytest.mark.skipif(SANITIZED or not all(map(importlib.util.find_spec, ("sphinx", "myst_parser", "furo"))), reason="Sphinx, MyST or furo is not installed")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Warnings of Sphinx, such as a link to a heading that a page lacks, are errors."""
    folder, reference = tmp_path_factory.mktemp("site") / "site", tmp_path_factory.mktemp("reference")
    (reference / "index.html").write_text("<p>The C interface</p>")
    done = subprocess.run([sys.executable, SOURCE / "docs" / "site" / "make_site", folder, "--reference", reference, "--program", REFDYN], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_links_lead_somewhere(site):
    missing = []
    for page in some(site.rglob("*.html")):
        text = page.read_text()
        for target in re.findall(r'(?:href|src)="([^"#?]+)', text):
            path = urllib.parse.unquote(target)
            if not re.match(r"[a-z]+:|//", path) and not (page.parent / path).exists():
                missing.append(f"{page.relative_to(site)}: {target}")
    assert not missing


def test_moving_page(site):
    """A page of `refdyn view` that a page names is part of the site."""
    assert 'href="../moving/hub_link.html"' in (site / "docs" / "drives.html").read_text() and len((site / "moving" / "hub_link.html").read_text()) > 500_000


def test_nothing_comes_from_the_network(site):
    for page in some(site.rglob("*.html")):
        text = page.read_text()
        loaded = re.findall(r'<(?:script|img|iframe|source)[^>]*src="([^"]*)"|<link[^>]*href="([^"]*)"', text)
        assert not [target for pair in loaded for target in pair if re.match(r"(https?:)?//", target)], page


def test_readers_find_their_pages(site):
    text = (site / "index.html").read_text()
    captions = re.findall(r'<span class="caption-text">(.*?)</span>', text)
    assert captions == ["For the user", "For the caller from C", "For the contributor"]
    for page in some((SOURCE / "docs").glob("*.md")):
        assert f'href="docs/{page.stem}.html"' in text, page
    assert "simulate(" in (site / "python-reference.html").read_text() and "rd.shaper" in (site / "models" / "README.html").read_text()
    assert "shaper" in (site / "searchindex.js").read_text()
