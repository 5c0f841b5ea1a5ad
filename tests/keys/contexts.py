"""The flights in which keys are tried, scenario by scenario."""

from __future__ import annotations

from tests.keys.failing import gate, health, silent, wrong
from tests.keys.situations import Context, Situation, event, events

NOW = ("plant.event.0.t_s=0.5", "plant.event.1.t_s=0.5")
PUFF = '[{axis = "down", size_mps = -2.0, start_s = 0.5, length_s = 1.0, shape = "one_cosine"}]'
SLOW = Situation("slow variation of the wind", r"wind\.slow\.(tau_s|from_zero)", ("plant.wind.slow.sigma_mps=2.0",))


def level(V: float) -> Situation:
    """Met at the airspeed V [m/s]."""
    sets = ("plant.wind.dryden.sigma_mps=0.0", f"plant.wind.dryden.V_mps={V}")
    return Situation("turbulence by name", r"wind\.dryden\.level", sets)


DRYDEN = Situation(
    "turbulence, not along north",
    r"wind\.dryden\..*",
    ("plant.wind.dryden.sigma_mps=1.0", "plant.aircraft.0.start.psi_deg=30.0"),
)
SHEAR = tuple(f"twinjet.guid.hazard.{k}" for k in ("settle_s=0.0", "caution_F=0.01", "abort_F=0.01"))

CAUTION = ("twinjet.guid.hazard.settle_s=0.0", "twinjet.guid.hazard.caution_F=0.01", "twinjet.guid.hazard.abort_F=1.0")


def action(t_s: float, name: str) -> str:
    """A command to the receiver."""
    return event(t_s=t_s, kind="command", target="receiver", action=name)


ROUGH = ("plant.wind.dryden.sigma_mps=6.22", "plant.wind.dryden.step=[{t_s = 4.0, sigma_mps = 0.0}]")
RIDDEN = ("on=true", "window_s=2.0", "calm_s=1.0")
# choices of the estimators: why, keys, set after the owner
CHOICES = (
    ("wind calculated", r"nav\.cmw_samples", "nav.cmw=true"),
    ("wind of first order", r"nav\.wind_tau_s", "nav.wind_model=gauss_markov"),
    ("turbulence as states", r"nav\.(gust_.*|q_slow)", "nav.wind_model=dryden"),
    ("noise of a colour", r"nav\.colour", "nav.colour_tau_s=1.0"),
)
DIFFERENCED = ("nav.colour_tau_s=1.0", "nav.colour=removed")
BOTH_DIFFERENCED = tuple(f"{w}.{s}" for w in ("tanker", "receiver") for s in DIFFERENCED)
AT = "[-36.0, 0.0, 8.5]"
CONTACT = (
    f"plant.aircraft.receiver.start.xi_m={AT}", f"receiver.guid.observation_m={AT}", f"receiver.guid.precontact_m={AT}",
    "receiver.guid.ready_error_m=3.0", "receiver.guid.settle_s=0.5", "plant.refuel.capture_s=0.2",
    events(action(2.5, "precontact"), action(7.5, "contact")),
)  # fmt: skip


TURNS = ("plant.traffic.manoeuvre_at_s=0.5", "plant.traffic.turn_deg=30.0", "plant.traffic.speed_change_mps=10.0")
NEAR = (
    'plant.aircraft.receiver.start={relative_to = "tanker", xi_m = [-80.0, 65.0, 5.0]}', "receiver.join.guid.seen_s=0.5",
    "receiver.join.settle_s=1.0",
)  # fmt: skip


def placed(y: float) -> tuple[str, ...]:
    """At contact, y [m] aside."""
    at = f"[-35.6, {y}, 6.9]"
    return (
        f"plant.aircraft.receiver.start.xi_m={at}",
        f"receiver.guid.observation_m={at}",
        f"receiver.guid.precontact_m={at}",
    )


BY_CONTOURS = "receiver.airdata.position.method=algorithm_11"
JUMP = events(event(t_s=1.0, kind="bias", target="alexis", sensor="air", channel="alpha", value=[0.1]))
FLAP_JAMS = events(event(t_s=1.0, kind="jam", target="alexis", surface="aileron"))

_TACAN = "plant.sensors.tanker.tacan."
OWN_RATE = tuple(
    f"{_TACAN}{key}" for key in ("bearing_std_deg=1.0", "bearing_dt_s=0.5", "link_std_m=50.0", "link_dt_s=0.5")
)

CONTEXTS = (
    Context(
        "gust",
        ("plant", "alexis"),
        (
            SLOW,
            level(20.0),
            DRYDEN,
            Situation("sensors with a bias", r"noise\.bias_scale", ("plant.sensors.alexis.imu.acc_bias_std=0.05",)),
            Situation("the events happen", r"event\..*", NOW),
            Situation("both use the flap", r"aircraft\.plant\.servo\.flap_deg", ("reference.ctrl.law=alleviation",)),
            *health("alexis", ("imu", "air", "att", "gnss")),
            Situation("one filter", r"nav\.scale", ("alexis.nav.estimator=ekf",)),
            Situation("servos taken as known", r"nav\.servo_slack_s", ("alexis.nav.estimator=bank",)),
            Situation(
                "servos and lift of another aircraft",
                r"nav\.servo_bank\.(forget_s|lead|lift_designs)",
                ("plant.aircraft.0.plant.servo.wn_radps=80.0", "plant.aircraft.0.plant.lift_factor=0.7"),
                4.0,
            ),
            Situation("a vane that jumps", r"nav\.servo_bank\.vane\.(jump|load|out_s|anew_rad)", (JUMP,)),
            Situation(
                "a vane that has jumped and stays away",
                r"nav\.servo_bank\.vane\.rest_s",
                (JUMP, "alexis.nav.servo_bank.vane.anew_rad=0.001"),
                4.0,
            ),
            Situation(
                "a load that is dear at once", r"nav\.load_watch\.ratio", ("alexis.nav.load_watch.settle_s=0.1",), 3.0
            ),
            Situation(
                "a load that is dear now and then",
                r"nav\.load_watch\.window_s",
                ("alexis.nav.load_watch.ratio=0.75", "alexis.nav.load_watch.settle_s=0.2"),
                4.0,
            ),
            Situation(
                "a load that is never cheap enough",
                r"nav\.load_watch\..*",
                (
                    "alexis.nav.load_watch.ratio=0.1",
                    "alexis.nav.load_watch.settle_s=0.2",
                    "alexis.nav.load_watch.back_s=0.4",
                ),
                3.0,
            ),
            Situation("a flap that jams", r"nav\.trust\.nis_fast_s", (FLAP_JAMS,), 3.0),
            Situation("a reading silent", r"nav\.trust\.age_s", (silent("alexis", "baro", each_s=1.5),), 3.0),
            Situation("a filter in doubt", r"nav\.trust\.nis_s", ("alexis.nav.trust.nis=1.0",), 3.0),
            Situation(
                "a reading refused",
                r"nav\.trust\.refused",
                (events(event(t_s=0.8, kind="bias", target="alexis", sensor="baro", value=[60.0])),),
            ),
            Situation(
                "doubts that pass",
                r"nav\.trust\.grave_s",
                ("alexis.nav.trust.nis=1.0", "alexis.nav.trust.nis_s=0.1", "alexis.nav.trust.back_s=0.1"),
                3.0,
            ),
            Situation("the elevator's law", r"ctrl\.elevator\..*", ("alexis.ctrl.law=elevator",)),
            Situation("the hold", r"ctrl\.hold\..*", ("alexis.ctrl.law=hold",)),
            Situation(
                "gusts of the table happen",
                r"aircraft\.plant\.wind\.gusts\..*",
                (f"plant.aircraft.0.plant.wind.gusts={PUFF}", f"plant.aircraft.1.plant.wind.gusts={PUFF}"),
            ),
        ),
        sets=("alexis.nav.servo_bank.wait_s=0.5",),
    ),
    Context(
        "windshear",
        ("plant", "twinjet"),
        (
            SLOW,
            level(75.0),
            DRYDEN,
            Situation("sensors with a bias", r"noise\.bias_scale", ("plant.sensors.twinjet.imu.acc_bias_std=0.05",)),
            *health("twinjet", ("imu", "air", "att", "gnss")),
            Situation("filter of sigma points", r"nav\.spread", ("twinjet.nav.filter=ukf",)),
            Situation(
                "five readings wrong at once",
                r"nav\.(refused_max|channels_most)",
                (wrong("twinjet", 0.0),),
            ),
            Situation(
                "lift believed wrong",
                r"nav\.monitor\.disagree_.*",
                ("twinjet.nav.states=13", "twinjet.nav.lift_scale=1.3", "twinjet.nav.monitor.disagree_s=0.2"),
                4.0,
            ),
            Situation("a reading missing", r"nav\.monitor\.held_s", (silent("twinjet", "air"),)),
            Situation(
                "below the slope",
                r"guid\.approach\.climb_max_mps",
                ("twinjet.guid.approach.slope_deg=1.0", "twinjet.guid.approach.gain_1ps=2.0"),
                4.0,
            ),
            Situation("caution", r"guid\.(approach\.caution_speed_mps|hazard\.(abort_on|release_F))", CAUTION, 4.0),
            Situation("after it has settled", r"guid\.hazard\.(caution_s|abort_s|rates|settle_s)", (), 4.0),
            Situation("judged at once", r"guid\.hazard\.(caution_F|abort_F|gain_F)", (CAUTION[0],), 4.0),
            Situation(
                "gain of energy", r"guid\.hazard\.gain_hold_s", (CAUTION[0], "twinjet.guid.hazard.gain_F=0.01"), 6.0
            ),
            Situation(
                "sinking air",
                r"guid\.hazard\.sink_.*",
                (CAUTION[0], "twinjet.guid.hazard.sink_F=0.005", CAUTION[2], "twinjet.guid.hazard.gain_abort=false"),
                4.0,
            ),
            Situation(
                "a loss after a gain",
                r"guid\.hazard\.gain_abort",
                (*CAUTION, "twinjet.guid.hazard.gain_F=0.01", "twinjet.guid.hazard.sink_F=0.0"),
                6.0,
            ),
            Situation(
                "a hard shear",
                r"guid\.escape\.deeper_.*",
                (
                    *SHEAR,
                    "twinjet.guid.escape.target_m=345.0",
                    "twinjet.guid.escape.deeper_from_F=0.002",
                    "twinjet.guid.escape.deeper_to_F=0.5",
                ),
            ),
            Situation("escape by pitch", r"guid\.escape\.pitch_deg", (*SHEAR, "twinjet.guid.escape.law=pitch")),
            Situation("escape by climb", r"guid\.escape\.climb_mps", (*SHEAR, "twinjet.guid.escape.law=climb")),
            Situation("escape above its height", r"guid\.escape\.descent_mps", SHEAR),
            Situation(
                "escape below its height", r"guid\.escape\.rise_mps", (*SHEAR, "twinjet.guid.escape.target_m=450.0")
            ),
            Situation(
                "escape near its height",
                r"guid\.escape\.(target_m|height_gain_1ps)",
                (*SHEAR, "twinjet.guid.escape.target_m=345.0"),
            ),
            Situation(
                "behind the shear",
                r"guid\.escape\.(after_mps|clear_s|hold_F|again_F)",
                (*SHEAR, "twinjet.guid.escape.clear_s=0.2", "twinjet.guid.escape.again_F=0.06"),
                6.0,
            ),
            Situation(
                "escape too slow",
                r"guid\.escape\.protect_.*",
                (*SHEAR, "twinjet.guid.escape.target_m=450.0", "twinjet.guid.escape.protect_mps=95.0"),
            ),
        ),
    ),
    Context(
        "refueling",
        ("plant", "tanker", "receiver"),
        (
            SLOW,
            level(195.0),
            Situation(
                "a wake that lies where it was flown",
                r"wind\.wake\.(sink|meander|edr_m2ps3)",
                ("plant.wind.wake.path=flown",),
            ),
            Situation("until test inputs begin", r"excitation\.on", (), 32.0),
            Situation(
                "test inputs", r"excitation\.(?!on$).*", ("tanker.excitation.on=true", "tanker.excitation.start_s=0.5")
            ),
            Situation("a bow wave", r"wind\.bow\.(core_m|radius_m)", ("plant.wind.bow.source=receiver",)),
            Situation(
                "in the wake's core", r"wind\.wake\.nu_m2ps", ("plant.aircraft.receiver.start.xi_m=[-36.0, 4.0, 1.0]",)
            ),
            Situation("contact", r"refuel\..*", CONTACT, 16.0),
            Situation(
                "the events happen", r"event\..*", tuple(f"plant.event.{i}.t_s={0.5 + 0.1 * i}" for i in range(4))
            ),
            *health("receiver", ("imu", "air", "att", "gnss", "rel"), "tanker"),
            *gate(("tanker", "receiver")),
            *(Situation(why, keys, (f"tanker.{s}", f"receiver.{s}")) for why, keys, s in CHOICES),
            Situation(
                "noise differenced",
                r"nav\.colour_form",
                tuple(f"{w}.{s}" for w in ("tanker", "receiver") for s in DIFFERENCED),
            ),
            Situation("rotation of the air as states", r"nav\.rot_.*", ("receiver.nav.rotational_wind=true",)),
            Situation(
                "noise as states",
                r"nav\.r_peer_rate",
                ("receiver.nav.colour_tau_s=1.0", "receiver.nav.colour=augmented"),
            ),
            Situation("rough air", r"rough_air\.on", ROUGH, 4.0),
            Situation(
                "rough air that calms",
                r"rough_air\..*",
                (*ROUGH, *(f"{w}.rough_air.{k}" for w in ("tanker", "receiver") for k in RIDDEN)),
                11.0,
            ),
        ),
    ),
    Context(
        "rendezvous",
        ("plant", "tanker"),
        (
            SLOW,
            level(203.7),
            *health("tanker", ("imu", "air", "att", "gnss")),
            *gate(("tanker",)),
            *(Situation(why, keys, (f"tanker.{s}",)) for why, keys, s in CHOICES),
            Situation("noise differenced", r"nav\.colour_form", tuple(f"tanker.{s}" for s in DIFFERENCED)),
            Situation(
                "one set of three states",
                r".*estimator\.(ekf3_.*)",
                (
                    "tanker.rendezvous.track.estimator.estimator=ekf3",
                    "tanker.rendezvous.track.estimator.rules.believed=0",
                    "tanker.rendezvous.track.estimator.rules.repeat_m=0.0",
                    "tanker.rendezvous.track.estimator.aids.on=false",
                    "tanker.rendezvous.track.estimator.rules.open=false",
                    "tanker.rendezvous.track.estimator.rules.open_back=0",
                    "tanker.rendezvous.track.estimator.rules.open_turn_deg=0.0",
                    "tanker.rendezvous.track.estimator.rules.open_speed_mps=0.0",
                ),
                2.0,
            ),
            Situation(
                "no radar",
                r".*track\.(y_hat_m|sigma_y_m|radar_wait_s)",
                ("plant.traffic.y_sigma_m=0.0", "plant.sensors.tanker.tacan.interval_s=1.0"),
                8.0,
            ),
            Situation(
                "a bearing",
                r".*bearing_sigma_deg",
                ("plant.sensors.tanker.tacan.bearing_std_deg=1.0", "plant.sensors.tanker.tacan.interval_s=1.0"),
                4.0,
            ),
            Situation(
                "no reply",
                r".*track\.lost_s",
                (
                    "plant.sensors.tanker.tacan.interval_s=1.0",
                    events(event(t_s=1.5, kind="dropout", target="tanker", sensor="tacan")),
                ),
                6.0,
            ),
            Situation(
                "bearing and data link of their own",
                r".*tacan\.(bearing_tau_s|link_(tau_s|latency_ms|loss))|.*aids\.(on|.*_tau_s|.*_constant_.*)|.*aid_every_s",
                (*OWN_RATE, "plant.sensors.tanker.tacan.interval_s=1.0"),
                6.0,
            ),
            Situation(
                "a receiver heard to turn",
                r".*aids\.(limit|fade_s|back_s|stir_m2ps3|noisy_s|kept)",
                (
                    *OWN_RATE,
                    "plant.sensors.tanker.tacan.link_std_m=2.0",
                    "tanker.rendezvous.track.estimator.datalink_sigma_m=2.0",
                    "tanker.rendezvous.track.estimator.aids.kept=6",
                    "plant.traffic.manoeuvre_at_s=6.0",
                    "plant.traffic.turn_deg=30.0",
                ),
                18.0,
            ),
            Situation(
                "a receiver as fast as the trim, heard, near the turn",
                r".*meeting\.(speed_sigma|wind_sigma_mps)",
                (*OWN_RATE, "plant.traffic.V_mps=224.0", "plant.traffic.x_m=42000.0"),
                36.0,
            ),
            Situation(
                "bearing and data link",
                r".*tacan\.(bearing_bias_std_deg|link_bias_std_m|(bearing|link)_dt_s)|.*track\.use_(bearing|link)|.*datalink_sigma_m",
                (
                    "plant.sensors.tanker.tacan.bearing_std_deg=1.0",
                    "plant.sensors.tanker.tacan.link_std_m=50.0",
                    "plant.sensors.tanker.tacan.interval_s=1.0",
                ),
                4.0,
            ),
            Situation(
                "fixed offset", r".*guidance\.offset_m", ("tanker.rendezvous.pilot.guidance.offset_bank_deg=0.0",)
            ),
            Situation(
                "from the left",
                r".*meeting\.both_sides",
                ("plant.aircraft.0.start.pos_n_m=[9000.0, 0.0, -7010.0]",),
            ),
            Situation(
                "from near the track",
                r".*meeting\.(leg_.*|box_.*|hold_s|on)",
                ("plant.aircraft.0.start.pos_n_m=[-5000.0, 0.0, -7010.0]",),
            ),
            Situation(
                "a receiver that turns away",
                r".*rules\.open_(back|turn_deg|speed_mps)|.*meeting\.straight",
                ("plant.traffic.manoeuvre_at_s=60.0", "plant.traffic.turn_deg=-20.0"),
            ),
            Situation(
                "a receiver that slows at once",
                r".*rules\.(open|open_v._mps|open_._m|young_z)",
                ("plant.traffic.manoeuvre_at_s=15.0", "plant.traffic.speed_change_mps=-40.0"),
            ),
            Situation(
                "closed loop", r".*guidance\.(gain|guard)", ("tanker.rendezvous.pilot.guidance.law=closed_loop",)
            ),
            Situation("chart", r".*guidance\.chart_range_m", ("tanker.rendezvous.pilot.guidance.law=chart",)),
            Situation(
                "weave", r".*guidance\.weave_half_period_s", ("tanker.rendezvous.pilot.guidance.weave_deg=20.0",)
            ),
            Situation(
                "a receiver that slows",
                r".*estimator\.window.*",
                ("plant.traffic.manoeuvre_at_s=60.0", "plant.traffic.speed_change_mps=-40.0"),
            ),
            Situation(
                "a receiver that turns and slows",
                r"traffic\.(manoeuvre_at_s|turn_.*|speed_.*)",
                (
                    "plant.traffic.manoeuvre_at_s=0.5",
                    "plant.traffic.turn_deg=30.0",
                    "plant.traffic.speed_change_mps=10.0",
                ),
            ),
        ),
    ),
    Context(
        "joinup",
        ("receiver",),
        (
            *gate(("receiver",), "join.nav"),
            *(Situation(why, rf"join\.{keys}", (f"receiver.join.{s}",)) for why, keys, s in CHOICES),
            Situation("noise differenced", r"join\.nav\.colour_form", tuple(f"receiver.join.{s}" for s in DIFFERENCED)),
            Situation("near the tanker", r"join\.settle_.*", NEAR, 6.0),
        ),
        r"join\..*",
    ),
    Context(
        "airdata",
        ("receiver",),
        (
            Situation(
                "at the edge of the map",
                r"airdata\.position\.contours\.outside_m",
                (*placed(2.3), BY_CONTOURS),
                3.0,
            ),
            Situation(
                "position by contours", r"airdata\.position\.(contours\..*|method)", (*placed(0.3), BY_CONTOURS), 3.0
            ),
        ),
        r"airdata\..*",
    ),
)
