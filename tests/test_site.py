"""The documentation as a site (docs/site/make_site): it needs no network, and every link within it leads somewhere."""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import urllib.parse

import pytest

import browser
from program import REFDYN, SANITIZED, SOURCE, some

pytestmark = pytest.mark.skipif(SANITIZED or not all(map(importlib.util.find_spec, ("sphinx", "myst_parser", "furo"))), reason="Sphinx, MyST or furo is not installed")


def make(folder, reference, **env):
    """Warnings of Sphinx, such as a link to a heading that a page lacks, are errors."""
    (reference / "index.html").write_text("<p>The C interface</p>")
    done = subprocess.run([sys.executable, SOURCE / "docs" / "site" / "make_site", folder, REFDYN, "--reference", reference], capture_output=True, text=True, env={**os.environ, **env})
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return make(tmp_path_factory.mktemp("site") / "site", tmp_path_factory.mktemp("reference"))


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
    assert 'href="../moving/hub_link.html"' in (site / "docs" / "drives.html").read_text() and len((site / "moving" / "hub_link.html").read_text()) > 200_000


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


# ---- Live pages

NEEDS_WASM = pytest.mark.skipif(not pathlib.Path("/usr/include/wasm32-wasi/stdio.h").exists(), reason="wasi-libc is not installed")


@NEEDS_WASM
def test_the_gallery_is_live(site):
    """Each picture is a link to a page of its model, whose size the text states."""
    text = (site / "docs" / "gallery.html").read_text()
    pictures = re.findall(r'<a href="\.\./live/(\w+)\.html[^"]*"><img alt="(\w+)"', text)
    stated = re.findall(r'<a href="\.\./live/(\w+)\.html[^"]*">Move it</a> \((\d\.\d\d) MB\)', text)
    models = sorted(path.stem for path in (SOURCE / "docs" / "gallery").glob("*.png"))
    assert sorted(name for name, _ in pictures) == sorted(name for name, _ in stated) == models and all(name == alt for name, alt in pictures)
    for name, size in stated:
        assert abs((site / "live" / f"{name}.html").stat().st_size - 1e6 * float(size)) <= 5e3 and float(size) < 0.8


@NEEDS_WASM
def test_a_page_of_the_gallery_moves(site):
    """From disk, with the values of its command and from the equilibrium that the command names."""
    with browser.Session(site / "docs" / "gallery.html") as page:
        page.wait("document.readyState === 'complete' && document.querySelector('a[href*=spinup]') !== null")
        page.ask("document.querySelector('a[href*=\"live/manipulator\"]').click()")
        page.wait(f"location.pathname.endsWith('live/manipulator.html') && {browser.SHOWN}", 60)
        assert page.ask("return byId('command').value").startswith("refdyn sim models/manipulator.lua --from statics --until 10 ")
    with browser.Session(site / "live" / "spinup.html") as page:
        page.wait(browser.SHOWN, 60)
        assert "--set T=5 --until 6" in page.ask("return byId('command').value")


@NEEDS_WASM
def test_the_tutorial_is_live(site):
    """The arm of its third section, inside its text; no script of the theme fails from disk."""
    with browser.Session(site / "docs" / "tutorial.html") as page:
        page.wait("document.readyState === 'complete' && document.querySelector('iframe') !== null")
        page.ask("document.querySelector('iframe').scrollIntoView()")
        frames = page.wait("window.length === 1 && document.querySelector('iframe').src")
        assert frames.endswith("live/arm.html#from=statics") and not page.console, page.console
    with browser.Session(site / "live" / "arm.html", "#from=statics") as page:
        page.wait(browser.SHOWN, 60)
        assert "height" in page.ask("return values.p.map((one) => one.name)") and page.ask("return values.x.length") == 0


def test_a_site_without_the_compiler_says_so(tmp_path):
    (tmp_path / "reference").mkdir()
    site = make(tmp_path / "site", tmp_path / "reference", REFDYN_WASM_CC="no-clang")
    text = (site / "docs" / "gallery.html").read_text()
    assert "no compiler ‘no-clang’ is installed; it compiles to WebAssembly with clang, lld, wasi-libc" in text and "Move it" not in text
    assert not list((site / "live").glob("*")) and "<iframe" not in (site / "docs" / "tutorial.html").read_text()
