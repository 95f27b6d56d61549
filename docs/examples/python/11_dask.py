"""A sweep over the servicer's mass on a Dask cluster: missions and scenarios go out, plans come back whole. The cluster
is two processes here; with `Client("scheduler:8786")` the same lines run on machines that have the wheel."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from dask.distributed import Client, LocalCluster

import remora

if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    masses = [300.0, 400.0, 500.0, 600.0]
    missions = [remora.Mission.default().replace(servicer={"bus_mass_kg": mass}) for mass in masses]
    cases = remora.draw(4, seed=1)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        tasks = [[client.submit(remora.plan, case, mission) for case in cases] for mission in missions]
        plans: list[list[remora.Plan]] = client.gather(tasks)
    figure, axes = plt.subplots(layout="constrained")
    for mission, row in zip(missions, plans, strict=True):
        assert all(plan.is_verified and plan.mission == mission for plan in row)
        force = [np.linalg.norm(plan.force, axis=1).max() for plan in row]
        axes.scatter([mission.servicer.bus_mass_kg] * len(row), force)
    print(f"{sum(map(len, plans))} plans verified, for {len(missions)} masses of the bus")
    axes.set(xlabel="mass of the bus [kg]", ylabel="largest force [N]")
    figure.savefig(folder / "11_dask.svg")
