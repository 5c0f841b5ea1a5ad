"""Situations in which sensors fall silent, stick or lie."""

from __future__ import annotations

from tests.keys.situations import Situation, event, events


def silent(who: str, *groups: str, start_s: float = 0.8, each_s: float = 0.4) -> str:
    """One sensor after the other is silent."""
    return events(
        *(
            event(t_s=start_s + i * each_s, kind="dropout", target=who, sensor=g, for_s=each_s - 0.1)
            for i, g in enumerate(groups)
        )
    )


def wrong(who: str, for_s: float) -> str:
    """Many readings wrong at once from 0.8 s on."""
    bias = (("air", [30.0, 0.5, 0.3]), ("gnss", [0.0, 0.0, 0.0, 30.0, 30.0, 30.0]), ("baro", [90.0]))
    return events(*(event(t_s=0.8, kind="bias", target=who, sensor=s, value=v, for_s=for_s) for s, v in bias))


def health(who: str, groups: tuple[str, ...], also: str = "") -> tuple[Situation, ...]:
    """Sensors that fall silent one by one, or are stuck."""
    both = [(w, g) for w in (who, also) if w for g in groups if g != "rel" or w == who]
    fall = [event(t_s=0.8 + 0.7 * groups.index(g), kind="dropout", target=w, sensor=g, for_s=0.6) for w, g in both]
    if "rel" in groups:
        fall.append(event(t_s=0.8 + 0.7 * len(groups), kind="link_loss", target=who, for_s=0.8))
    stuck = [event(t_s=0.8, kind="stuck", target=w, sensor="air", for_s=0.8) for w in (who, also) if w]
    return (
        Situation("silent sensors", r"health\.\w+_age_s", (events(*fall),), 1.6 + 0.7 * len(groups)),
        Situation("a stuck sensor", r"health\.stuck_samples", (events(*stuck),)),
    )


def gate(owners: tuple[str, ...], nav: str = "nav") -> tuple[Situation, ...]:
    """Readings that navigation has reason to refuse; `owners` are those whose keys are tried, `nav` the table."""
    probes = {"tanker": 1, "receiver": 3}  # one after the other: V, alpha, beta

    def lies(t_s: float, *who: str) -> str:
        wrong = {w: [30.0, 0.3, 0.3] * probes[w] for w in who}
        return events(*(event(t_s=t_s, kind="bias", target=w, sensor="air", value=wrong[w], for_s=4.0) for w in who))

    mute = [
        event(t_s=1.2, kind="dropout", target=w, sensor=s, for_s=1.5)
        for w in owners
        for s in ("imu", "air", "att", "gnss", "rel")
        if s != "rel" or w == "receiver"
    ]
    quiet = tuple(f"{w}.{nav}.gate.silent_s=1.0" for w in owners)
    deaf = tuple(f"{w}.{nav}.gate.lift_sigma=10.0" for w in owners)
    blind = [event(t_s=1.2, kind="dropout", target=w, sensor="att", for_s=1.2) for w in owners]
    jump = [
        event(t_s=2.5, kind="bias", target=w, sensor="imu", value=[0.0, 0.15, 0.0, 0.0, 0.0, 0.0], for_s=4.0)
        for w in owners
    ]
    return (
        Situation("a gyro jumps", rf"{nav}\.gate\.turn_sigma", (events(*jump),), 5.0),
        Situation("nothing measures attitude", rf"{nav}\.(bias_gyro|gate\.loose_rate)", (events(*blind),), 3.0),
        Situation("all sensors silent", rf"{nav}\.gate\.silent_s", (events(*mute), *quiet), 3.0),
        Situation("at the start", rf"{nav}\.gate\.(samples|lift_error|(wind|pos|att)_sigma_max)", (), 2.0),
        # forces are compared for ten seconds before they bear witness
        Situation("air data lie to witnesses", rf"{nav}\.gate\.(lift|side)_sigma", (lies(11.0, *owners),), 14.5),
        Situation(
            "only the leader's wind speaks", rf"{nav}\.gate\.peer_wind_sigma", (lies(11.0, *owners[-1:]), *deaf), 14.5
        ),
        Situation("air data lie from a moment on", rf"{nav}\.gate\..*", (lies(1.2, *owners),), 3.0),
    )
