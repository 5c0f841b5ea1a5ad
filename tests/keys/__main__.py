"""Try every key: `python -m tests.keys [--only CONTEXT] [--keys PATTERN]`. Prints those that do nothing; writes acting.toml."""

from __future__ import annotations

import argparse
import re
import sys
import time

from hil_scripts.launch import kernel_cache


def main() -> int:
    """Exit code 0: every key tried acts or is refused by name."""
    kernel_cache.use()
    from tests.keys import ledger
    from tests.keys.contexts import CONTEXTS
    from tests.keys.flights import baseline, designs_kept
    from tests.keys.keys import all_keys
    from tests.keys.situations import short
    from tests.keys.values import ELSEWHERE, PENDING

    parser = argparse.ArgumentParser(prog="tests.keys", description=__doc__)
    parser.add_argument("--only", help="one context: the name of its scenario")
    parser.add_argument("--keys", default="", help="only keys whose name holds this pattern")
    a = parser.parse_args()
    dead = []
    t0 = time.process_time()
    for c in CONTEXTS:
        if a.only not in (None, c.scenario):
            continue
        found: dict[str, str] = {}
        with designs_kept():
            plan, _ = baseline(c.scenario, c.sets, c.duration_s)
            keys = [k for k in all_keys(plan) if k.name.partition(".")[0] in c.owners]
            for k in keys:
                if (
                    k.place in ELSEWHERE
                    or k.place in PENDING
                    or not re.fullmatch(c.only or ".*", short(k))
                    or not re.search(a.keys, k.name)
                ):
                    continue
                answer = ledger.tried(c, k)
                if answer and not answer.startswith("?"):
                    found[k.name] = answer
                else:
                    dead.append(k.name)
                    print(f"{c.scenario} {k.name} = {k.value!r}: {answer or 'NOTHING'}"[:170], flush=True)
        print(f"{c.scenario}: {len(found)} of {len(keys)} keys act, {time.process_time() - t0:.0f} s", flush=True)
        known = ledger.read()
        ledger.write(known | {c.scenario: (known.get(c.scenario, {}) if a.keys else {}) | found})
    return 1 if dead else 0


if __name__ == "__main__":
    sys.exit(main())
