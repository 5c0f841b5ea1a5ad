"""What a program written with MAVSDK gets from an aircraft: one JSON line. Called by test_clients.py with a UDP port."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from typing import Any

from mavsdk.component_type import ComponentType
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.failure import Failure, FailureType, FailureUnit
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

WAIT_S = 30.0  # [s] longest wait for anything


def until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds, or the time is over."""
    end = time.monotonic() + WAIT_S
    while not condition() and time.monotonic() < end:
        time.sleep(0.1)


def outcome(call: Callable[..., Any], *args: Any) -> str:
    """ "" if a call of the library succeeds, else the result it fails with."""
    try:
        call(*args)
    except Exception as e:
        result = getattr(e, "result", None)
        return result.name if result is not None else repr(e)
    return ""


def main(port: str, name: str) -> None:
    """Talk to the aircraft at the port; `name`: a parameter that may be set."""
    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    sdk.add_any_connection(f"udpout://127.0.0.1:{port}")
    system = sdk.first_autopilot(WAIT_S)
    telemetry, param, failure, plan = (c(system) for c in (Telemetry, Param, Failure, MissionRaw))
    modes: dict[int, str] = {}
    now: list[int] = []
    direct = MavlinkDirect(system)

    def heard(message: Any, _: Any = None) -> None:
        f = json.loads(message.fields_json)
        if message.message_name == "AVAILABLE_MODES":
            modes[f["custom_mode"]] = f["mode_name"]
        elif message.message_name == "CURRENT_MODE":
            now.append(f["custom_mode"])

    direct.subscribe_message("", heard)
    until(lambda: telemetry.health_all_ok() and telemetry.in_air())
    until(lambda: telemetry.position().latitude_deg > 0.0)
    out: dict[str, Any] = {"system": system.get_system_id(), "health_all_ok": telemetry.health_all_ok()}
    out["health"] = vars(telemetry.health())
    at = telemetry.position()
    out["position"] = [at.latitude_deg, at.longitude_deg, at.absolute_altitude_m, at.relative_altitude_m]
    out["unix_s"], out["in_air"] = telemetry.unix_epoch_time() / 1e6, telemetry.in_air()
    ask = {"target_system": out["system"], "target_component": 1, "command": 512, "param1": 435}
    ask |= {f"param{i}": 0 for i in range(2, 8)} | {"confirmation": 0}
    direct.send_message(MavlinkMessage("COMMAND_LONG", 245, 190, out["system"], 1, json.dumps(ask)))
    until(lambda: bool(now and modes))
    out["mode"] = modes.get(now[-1], "") if now else ""
    everything = param.get_all_params()
    out["parameters"] = [len(everything.float_params), len(everything.int_params)]
    before = param.get_param_float(name)
    out["set"] = outcome(param.set_param_float, name, before * 1.25)
    out["read_back"] = param.get_param_float(name) / before
    out["refused"] = [
        outcome(param.set_param_float, n, v) for n, v in ((name, 1e6), ("APP_SYSID", 7.0), ("NO_SUCH", 1.0))
    ]
    air = FailureUnit.SENSOR_AIRSPEED
    out["inject"] = [outcome(failure.inject, air, kind, 2) for kind in (FailureType.STUCK, FailureType.OK)]
    out["refused_failure"] = outcome(failure.inject, air, FailureType.STUCK, 9)
    out["route"] = [[i.x * 1e-7, i.y * 1e-7, i.z] for i in plan.download_mission()]
    out["fence"], out["rally"] = len(plan.download_geofence()), len(plan.download_rallypoints())
    print("RESULT " + json.dumps(out), flush=True)
    os._exit(0)  # the library's threads have no part in the verdict


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
