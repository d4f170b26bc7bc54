"""Every peer on the cases that the loop was scored on, one after the other, and the table of all of them.

    python -m studies.attribution_benchmark.peers.run --out OUT [--peer greedy] [--only TEXT]

OUT is that of `studies.attribution_benchmark.run`: cases and their truth in OUT/cases, the loop's judgements in
OUT/judged. Answers go to OUT/peers/<peer>/<case>.json; a case that a peer has answered is not asked again. PySINDy and
jax-sysid run in environments of their own, by the interpreters that SMAJAX_PYSINDY_PYTHON and SMAJAX_JAX_SYSID_PYTHON
name.
"""

from __future__ import annotations

import argparse
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

from studies.attribution_benchmark.peers.answer import Answer, load, save
from studies.attribution_benchmark.peers.bench import Bench, opened
from studies.attribution_benchmark.peers.greedy import chosen
from studies.attribution_benchmark.peers.handed import PYTHONS, told_by
from studies.attribution_benchmark.peers.plain import refitted
from studies.attribution_benchmark.peers.table import written

PEERS: dict[str, Callable[[Bench, Answer], Answer]] = {
    "plain": lambda _bench, base: base,
    "greedy": chosen,
    **{peer: partial(told_by, peer) for peer in PYTHONS},
}


def asked(peer: str, case: str, out: Path) -> Answer:
    """What `peer` says of one case, stored where it is an answer; the refitted base model, which all need, likewise."""
    bench = opened(out / "cases" / case)
    path = out / "peers" / "plain" / f"{case}.json"
    if not path.exists():
        save(refitted(bench, case), path)
    found = PEERS[peer](bench, load(path))
    if not found.reason:
        save(found, out / "peers" / peer / f"{case}.json")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--peer", choices=sorted(PEERS), action="append", default=[], help="may be given again")
    parser.add_argument("--only", default="", help="a part of the cases' names")
    given = parser.parse_args()
    from smajax.core.runtime import prepare

    prepare()
    cases = sorted(path.stem for path in (given.out / "judged").glob("*.json") if given.only in path.stem)
    for peer in given.peer or PEERS:
        for number, case in enumerate(cases, 1):
            if (given.out / "peers" / peer / f"{case}.json").exists():
                continue
            where = f"{peer} [{number}/{len(cases)}] {case}"
            try:
                one = asked(peer, case, given.out)
            except Exception:  # one case must not stop the others; it is reported and has no answer
                print(f"{where}: failed\n{traceback.format_exc()}", flush=True)
                continue
            if one.reason:
                print(f"{where}: {one.reason}", flush=True)
                break
            named = "+".join(one.added) or "+".join(one.where) or "names nothing"
            print(f"{where}: {named}; held out {one.held_out_error:.2f}, {one.seconds:.0f} s {one.said}", flush=True)
    print(written(given.out))


if __name__ == "__main__":
    main()
