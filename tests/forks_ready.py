"""What the prepared process has when programs are forked off it: the three programs and their launcher, kernels loaded."""

import importlib

from hil_scripts.launch import forked, kernel_cache

forked.prepare()  # before the environment changes
kernel_cache.use()
PROGRAMS = (
    "flightsw.__main__", "flightsw.process.program", "ground.__main__", "ground.link.record", "hil_scripts.sil",
    "sim_plant.__main__", "sim_plant.program",
)  # fmt: skip
LAUNCHER = ("finish", "inproc", "mission", "ports", "preflight", "runfolder", "warmup")
MOST = ("refueling", "rendezvous")  # flown most often

for name in (*PROGRAMS, *(f"hil_scripts.launch.{m}" for m in LAUNCHER)):
    importlib.import_module(name)
for scenario in MOST:
    importlib.import_module("hil_scripts.launch.inproc").fly_a_little(scenario, 0.1)
