"""The notebook: run anew by `python docs/notebook.py [OUT]`, in its own place unless told, and a page of the site.

Its pictures and numbers are those that it had when it was last run; `tests/docs/test_notebook.py` compares them.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import nbformat
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

NOTEBOOK = Path(__file__).resolve().parent / "notebook.ipynb"


class _Page(File):
    """A file whose page is Markdown, whatever its name."""

    def is_documentation_page(self) -> bool:
        return True


def on_files(files: Files, *, config: Any) -> Files:
    """Replace the notebook by Markdown, which looks like every page, and its pictures: a hook of MkDocs."""
    source = files.get_file_from_path(NOTEBOOK.name)
    if source is None:
        raise FileNotFoundError(NOTEBOOK)
    text, resources = MarkdownExporter().from_filename(str(NOTEBOOK), {"output_files_dir": f"{NOTEBOOK.stem}_files"})
    text = text.replace('<table border="1" class="dataframe">', "<table>")  # pandas' own look is not the site's
    files.remove(source)
    files.append(_Page.generated(config, NOTEBOOK.name, content=text))
    for name, content in resources["outputs"].items():
        files.append(File.generated(config, name, content=content))
    return files


def write(out: Path) -> None:
    """Run the notebook and write it. An error in a cell is raised."""
    from nbclient import NotebookClient

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    # Its `teamclone` is the command of this interpreter.
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    NotebookClient(
        notebook,
        timeout=600,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": NOTEBOOK.parent}},
    ).execute()
    nbformat.write(notebook, out)


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else NOTEBOOK)
