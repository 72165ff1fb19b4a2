"""What mkdocs does beyond Markdown: files outside docs/ that a page links join the site, notebooks become pages."""

import re
from pathlib import Path

from mkdocs.structure.files import File

OUTSIDE = re.compile(r"\]\(((?:\.\./)+(?!docs/)[\w./-]+\.(?:txt|md|toml))\)")
FOLDER = "linked"  # of the site, for what lies outside docs/


def on_files(files, config):
    """Add what pages link, and put a page in the place of each notebook."""
    docs = Path(config["docs_dir"])
    for page in [file for file in files if file.src_uri.endswith(".md")]:
        path = Path(page.abs_src_path)
        for link in OUTSIDE.findall(path.read_text(encoding="utf-8")):
            source = (path.parent / link).resolve()
            uri = f"{FOLDER}/{source.relative_to(docs.parent).as_posix()}"
            if uri not in files.src_uris and not source.is_relative_to(docs):
                files.append(File.generated(config, uri, content=source.read_text(encoding="utf-8")))
    for notebook in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.remove(notebook)
        files.append(File.generated(config, as_page(notebook.src_uri), content=converted(docs / notebook.src_uri)))
    return files


def on_config(config):
    """The navigation names notebooks, as they lie in docs/."""
    config["nav"] = _renamed(config["nav"])
    return config


def on_page_markdown(markdown, page, config, files):
    """Links to notebooks and to files outside docs/ lead to where these are in the site."""
    up = "../" * page.file.src_uri.count("/")
    root = Path(config["docs_dir"]).parent

    def moved(match: re.Match) -> str:
        source = (Path(page.file.abs_src_path).parent / match[1]).resolve() if page.file.abs_src_path else None
        return f"]({up}{FOLDER}/{source.relative_to(root).as_posix()})" if source else match[0]

    return re.sub(r"\]\(([\w/]+\.ipynb)\)", lambda m: f"]({as_page(m[1])})", OUTSIDE.sub(moved, markdown))


def as_page(uri: str) -> str:
    """The Markdown page that stands for a notebook."""
    return uri.replace(".ipynb", ".md")


def converted(notebook: Path) -> str:
    """A notebook with its outputs as Markdown, its pictures inside."""
    from nbconvert import MarkdownExporter

    text, resources = MarkdownExporter().from_filename(str(notebook))
    from base64 import b64encode

    for name, content in resources["outputs"].items():
        text = text.replace(f"({name})", f"(data:image/png;base64,{b64encode(content).decode()})")
    return text


def _renamed(nav):
    if isinstance(nav, str):
        return as_page(nav)
    if isinstance(nav, list):
        return [_renamed(item) for item in nav]
    return {title: _renamed(item) for title, item in nav.items()}
