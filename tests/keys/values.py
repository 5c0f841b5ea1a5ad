"""Keys that need a value of their own to show, and those that show elsewhere, or nowhere yet."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

# never shown by a flight in one process; each is read by the code named, which other tests run
ELSEWHERE = {
    "Meta.name": "a word for people, in scenario.toml",
    "Meta.purpose": "a word for people, in scenario.toml",
    "Meta.duration_s": "given here by the rig, as by --duration",
    "Clock.mode": "the process' loop; refused with --in-process (tests/sil)",
    "Clock.startup_timeout_s": "wall clock of the plant's process (sim_plant.loops, tests/sil)",
    "Clock.peer_timeout_s": "wall clock of the plant's process (sim_plant.loops, tests/sil)",
    "LinkConfig.host": "socket of the onboard process (flightsw.loop, tests/component)",
    "LinkConfig.plant_port": "socket of the onboard process (flightsw.loop, tests/component)",
    "LinkConfig.telemetry_port": "socket of the onboard process (flightsw.loop, tests/component)",
    "LinkConfig.targets": "socket of the onboard process (flightsw.loop, tests/component)",
    "LinkConfig.startup_timeout_s": "wall clock of the onboard process (flightsw.loop, tests/component)",
    "LinkConfig.peer_timeout_s": "wall clock of the onboard process (flightsw.loop, tests/component)",
}

# no flight or rig comes to these yet
PENDING = {
    f"{cls}.{field}": table["why"]
    for cls, table in tomllib.loads((Path(__file__).parent / "pending.toml").read_text()).items()
    for field in table["fields"].split()
}
# values that show, where a factor on the present one does not
VALUES: dict[str, tuple[Any, ...]] = {
    "AircraftCfg.name": ("other",),
    "AircraftCfg.file": ("learjet24", "kc135r", "alexis"),
    "AircraftCfg.mission": ("rendezvous", "gust_hold", "gust", "tanker", "windshear"),
    "AircraftCfg.rel_nav_to": ("", "tanker"),
    "AircraftCfg.boom_to": ("", "tanker"),
    "AircraftCfg.tacan_to": ("", "receiver", "nobody"),
    "AircraftCfg.fuel_kg": (1000.0,),
    "AircraftCfg.sysid": (7,),
    "Start.relative_to": ("", "nobody"),
    "Start.V_mps": (190.0, 72.0, 21.0),
    "Wind.sounding": ("missing.txt",),
    "Wake.source": ("", "nobody"),
    "TrafficCfg.name": ("other",),
    "TrafficCfg.on": (True, False),
    "Event.target": ("reference", "tanker", "nobody"),
    "Event.kind": ("drift", "dropout", "link_loss"),
    "Event.value": ((0.3,),),
    "Event.params": ((5.0,),),
    "Event.action": ("breakaway", "hold"),
    "AppConfig.mission": ("gust", "windshear", "rendezvous", "tanker"),
    "AppConfig.aircraft": ("kc135r", "learjet24"),
    "TelemetryConfig.rates_hz": ({"ATTITUDE_QUATERNION": 1.0},),
    "HealthParams.rate_max_radps": (1e-4,),
    "HealthParams.acc_max_mps2": (1.0,),
    "HealthParams.V_min_mps": (500.0,),
    "HealthParams.V_max_mps": (1.0,),
    "HealthParams.flow_max_rad": (1e-5,),
    "HealthParams.speed_max_mps": (1.0,),
    "HealthParams.rel_max_m": (1.0,),
    "HealthParams.stuck_samples": (3,),
    "Wind.sine": ([{"amplitude_mps": [1.0, 0.5, 0.2], "period_s": [2.0, 2.0, 2.0]}],),
    "Dryden.step": ([{"t_s": 0.5, "sigma_mps": 2.0}],),
    "Scenario.event": ([{"t_s": 0.5, "kind": "link_loss", "target": "nobody"}],),
    "TwinJetTable.gusts": ([{"axis": "tail", "size_mps": 2.0, "start_s": 0.5, "length_s": 0.5}],),
    "AlexisWind.steps": ([[0.5, 2.0]],),
    "Microburst.radius_m": (700.0,),
    "Gust.axis": ("tail",),
    "Gust.shape": ("ramp",),
    "WindshearNavTable.turbulence_range": ((0.0199, 0.0201),),
    "WindshearNavTable.gate": (1.0,),
    "HazardParams.caution_F": (0.01,),
    "HazardParams.abort_F": (0.01,),
    "HazardParams.release_F": (-1.0,),
    "HazardParams.gain_F": (0.01,),
    "HazardParams.gain_hold_s": (0.0, 0.1),
    "EscapeParams.protect_above_m": (400.0,),
    "EscapeParams.again_F": (0.5,),
    "TankerCtrlParams.int_limit": ((1e-4, 1e-4, 1e-6),),
    "ReceiverCtrlParams.int_limit_ms": ((1e-4, 1e-4, 1e-4),),
    "TrustParams.age_s": (0.1,),
    "TrustParams.H_sigma_m": (0.01,),
    "TrustParams.nis_s": (0.02,),
    "TrustParams.refused": (0.0,),
    "TrustParams.grave_s": (0.0,),
    "HoldParams.limit_rad": (1e-6,),
    "NavParams.settle_s": (1.0,),
    "TrafficCfg.manoeuvre_at_s": (1.0,),
    "TrackParams.sigma_y_m": (3000.0,),
    "TrackParams.lost_s": (1.0,),
    "TrackParams.radar_wait_s": (0.1, 1.5),
    "RendezvousNavParams.window": (2,),
    "RendezvousNavParams.window_nis": (1.0, 1e3),
    "RendezvousNavParams.window_drift": (1.0, 1e3),
    "RendezvousNavParams.gate_nis": (0.5,),
    "NidParams.turn_max_radps": (0.001,),
    "NidParams.alpha_min_rad": (0.09,),
    "ReceiverParams.tanker": ("learjet24",),
    "JoinParams.tanker": ("learjet24",),
    "NavParams.cmw_samples": (2,),
    "RendezvousGuidanceParams.bank_min_deg": (9.0,),
    "RendezvousGuidanceParams.chart_range_m": (45000.0,),
    "TrackParams.y_hat_m": (3000.0,),
    "AlexisServo.rate_degps": (1.0,),
    "AlexisServo.elevator_deg": (0.01,),
    "AlexisServo.flap_deg": (0.01,),
}
