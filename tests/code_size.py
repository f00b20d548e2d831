#!/usr/bin/env python3
"""Counts the code, the settings, the commands and the dependencies of the project.

    tests/code_size.py [--at REV]

Prints files, lines and types of the Rust and Python sources for each crate or folder: without tests (`tests` folders,
`#[cfg(test)] mod`), benchmarks and examples, without blank lines, comments and docstrings. Types are structs, enums,
traits and type aliases, in Python classes. Settings and commands are those of docs/reference.md; crates those of the
program's default build with its own. --at counts a revision of git in place of the working tree.
"""

import argparse
import ast
import collections
import io
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Folders whose files are not counted.
LEFT_OUT = {"tests", "benches", "examples"}

# Comments (the block ones begin here), strings, characters and lifetimes of Rust.
TOKEN = re.compile(
    r"""//[^\n]*|(?P<block>/\*)|(?<!\w)[bc]?r(?P<raw>\#*)".*?"(?P=raw)|[bc]?"(?:\\.|[^"\\])*"
    |b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^'\\\n])'|'\w+""",
    re.DOTALL | re.VERBOSE,
)
TEST_MODULE = re.compile(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*([;{])")
RUST_TYPE = re.compile(r"^\s*(?:pub(?:\([^)]*\))?\s+)?(?:unsafe\s+)?(struct|enum|trait|type)\s+[A-Z]", re.MULTILINE)
# Start of a block whose `type` is an associated one.
HAS_ASSOCIATED = re.compile(r"\s*(?:#\[[^\]]*\]\s*)*(?:pub(?:\([^)]*\))?\s+)?(?:unsafe\s+)?(?:impl|trait)\b")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--at", metavar="REV", help="count this revision of git")
    arguments = parser.parse_args()
    try:
        if arguments.at is None:
            listed = output(["git", "ls-files", "--cached", "--others", "--exclude-standard"], ROOT)
            print_counts(ROOT, listed.splitlines())
        else:
            with tempfile.TemporaryDirectory() as folder:
                archive = subprocess.run(["git", "archive", arguments.at], cwd=ROOT, check=True, stdout=subprocess.PIPE)
                with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
                    files.extractall(folder, filter="data")
                    print_counts(pathlib.Path(folder), files.getnames())
    except subprocess.CalledProcessError as error:
        return error.returncode


def output(command, folder):
    """Returns the output of a command."""
    return subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


def print_counts(root, names):
    """Prints the counts of the project in a folder."""
    rows = collections.defaultdict(collections.Counter)
    for (group, language), (lines, types) in counted(root, names):
        for row in ((group, language), ("total", language), ("total", "")):
            rows[row].update(files=1, lines=lines, types=types)
    print(f"{'':20} {'':6} {'files':>7} {'lines':>7} {'types':>7}")
    for name, language in sorted(rows, key=lambda row: (row[0] == "total", row)):
        row = rows[name, language]
        print(f"{name:20} {language:6} {row['files']:7} {row['lines']:7} {row['types']:7}")
    reference = (root / "docs/reference.md").read_text()
    settings = reference.split("\n## Settings\n")[1].split("\n## ")[0]
    tree = output(["cargo", "tree", "-p", "palpate", "-e", "normal,build", "--prefix", "none", "--locked"], root)
    print(f"settings {len(re.findall(r'^[|]`', settings, re.MULTILINE))}")
    print(f"commands {len(re.findall(r'^### `palpate ', reference, re.MULTILINE))}")
    # A package that the tree has shown before is marked with (*).
    print(f"crates {len({line.removesuffix(' (*)') for line in tree.splitlines() if line})}")


def counted(root, names):
    """Yields group and language, lines and types of each source file."""
    paths = [pathlib.PurePath(name) for name in names if (root / name).is_file()]
    sources = [path for path in paths if not LEFT_OUT & set(path.parts)]
    rust = {path: without_comments((root / path).read_text()) for path in sources if is_rust(path)}
    test_files = {file for path, text in rust.items() for file in test_modules(path, text)}
    for path, text in rust.items():
        if path not in test_files:
            yield (group(path), "Rust"), rust_counts(without_tests(text))
    for path in sources:
        if path.suffix == ".py":
            yield (group(path), "Python"), python_counts((root / path).read_text())


def is_rust(path):
    """Whether a file is compiled into a crate; others with this ending are examples."""
    return path.suffix == ".rs" and ("src" in path.parts or path.name == "build.rs")


def group(path):
    """Returns the crate or folder of a file."""
    if path.parts[0] in ("src", "build.rs"):
        return "palpate"
    return path.parts[1] if path.parts[0] == "crates" else path.parts[0]


def without_comments(text):
    """Replaces comments of Rust by spaces, and the characters of strings by a placeholder."""
    parts, end = [], 0
    while found := TOKEN.search(text, end):
        parts.append(text[end : found.start()])
        begin, end = found.span()
        if found["block"]:
            end = block_end(text, begin)
        is_comment = text.startswith(("//", "/*"), begin)
        parts.append(re.sub(r"\S", " " if is_comment else "~", text[begin:end]))
    return "".join(parts) + text[end:]


def block_end(text, begin):
    """Returns the end of the block comment at `begin`; such comments nest."""
    depth = 0
    for mark in re.compile(r"/\*|\*/").finditer(text, begin):
        depth += 1 if mark[0] == "/*" else -1
        if depth == 0:
            return mark.end()
    return len(text)


def test_modules(path, text):
    """Yields the files of test modules that `path` declares."""
    folder = path.parent if path.name in ("mod.rs", "lib.rs", "main.rs") else path.with_suffix("")
    for name, opening in TEST_MODULE.findall(text):
        if opening == ";":
            yield from (folder / f"{name}.rs", folder / name / "mod.rs")


def without_tests(text):
    """Removes the declarations and bodies of test modules."""
    while found := TEST_MODULE.search(text):
        end = found.end()
        depth = 1 if found[2] == "{" else 0
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[: found.start()] + text[end:]
    return text


def rust_counts(text):
    """Returns lines and types of Rust without comments and tests."""
    lines = sum(bool(line.strip()) for line in text.splitlines())
    types = RUST_TYPE.finditer(text)
    return lines, sum(found[1] != "type" or not is_associated(text, found.start(1)) for found in types)


def is_associated(text, place):
    """Whether the block around a place is an implementation or a trait."""
    depth = 0
    for i in range(place - 1, -1, -1):
        depth += {"}": 1, "{": -1}.get(text[i], 0)
        if depth < 0:
            begin = max(text.rfind(mark, 0, i) for mark in ";{}") + 1
            return HAS_ASSOCIATED.match(text, begin) is not None
    return False


def python_counts(text):
    """Returns lines and classes of Python."""
    left_out = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    written = text.splitlines()
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in left_out:
            spanned = range(token.start[0], token.end[0] + 1)
            lines.update(line for line in spanned if written[line - 1].strip())
    nodes = list(ast.walk(ast.parse(text)))
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines.difference_update(range(node.lineno, node.end_lineno + 1))
    return len(lines), sum(isinstance(node, ast.ClassDef) for node in nodes)


if __name__ == "__main__":
    sys.exit(main())
