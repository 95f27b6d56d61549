"""Missions in Python: dicts, attributes, changes; and what notebooks show."""

import json
from pathlib import Path

import numpy as np
import pytest

import remora


@pytest.fixture(scope="module")
def mission() -> remora.Mission:
    return remora.Mission.default()


def test_a_mission_is_a_dict_and_back(mission: remora.Mission, root: Path) -> None:
    arm = remora.Mission.from_urdf(root / "fixtures/urdf/spatial.urdf", tip="tip")
    for one in (mission, arm):
        values = one.to_dict()
        assert remora.Mission.from_dict(values) == one
        assert remora.Mission.from_dict(json.loads(json.dumps(values))).to_toml() == one.to_toml()
    assert remora.Mission.from_dict({}) == mission
    assert remora.Mission.from_dict({"target": {"mass_kg": 60.0}}).to_dict()["target"]["mass_kg"] == 60.0


def test_a_camera_with_an_impossible_inertia_is_taken_as_a_point(root: Path, tmp_path: Path) -> None:
    camera = """<link name="bad"><inertial><mass value="2"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="9"/></inertial></link>
        <joint name="bolts" type="fixed"><parent link="bus"/><child link="bad"/></joint></robot>"""
    path = tmp_path / "bad.urdf"
    path.write_text((root / "fixtures/urdf/spatial.urdf").read_text().replace("</robot>", camera))
    with pytest.raises(ValueError, match="--point-mass bad"):
        remora.Mission.from_urdf(path, tip="tip")
    mission = remora.Mission.from_urdf(path, tip="tip", point_mass={"bad"})
    assert mission.servicer.bus_mass_kg == 428.0
    with pytest.raises(ValueError, match="nobody"):
        remora.Mission.from_urdf(path, tip="tip", point_mass={"nobody"})


def test_its_values_are_attributes_with_the_keys_of_the_file(mission: remora.Mission) -> None:
    values = mission.to_dict()
    for name, value in values.items():
        assert getattr(mission, name) == value and name in dir(mission)
    assert mission.target.mass_kg == 50.0 and mission.target["mass_kg"] == 50.0
    assert mission.orbit.semi_major_axis_m == 6.8e6
    assert mission.servicer.links[0] == values["servicer"]["links"][0]
    first = next(iter(values["servicer"]["links"][0]))
    assert getattr(mission.servicer.links[0], first) == values["servicer"]["links"][0][first]
    assert mission.roll is None
    with pytest.raises(AttributeError, match="'remora.Mission' object has no attribute 'servicr'"):
        mission.servicr
    with pytest.raises(AttributeError, match="section has no 'mas_kg'; it has .*mass_kg"):
        mission.target.mas_kg
    # A section is the caller's own.
    mission.target["mass_kg"] = 7.0
    assert mission.target.mass_kg == 50.0


def test_a_changed_mission_is_another(mission: remora.Mission, case: remora.Scenario) -> None:
    heavy = mission.replace(target={"mass_kg": np.float64(60.0), "half_extents_m": np.array([0.4, 0.4, 0.2])})
    assert heavy.target.mass_kg == 60.0 and heavy != mission and hash(heavy) != hash(mission)
    assert heavy.target.inertia_kg_m2 == mission.target.inertia_kg_m2
    assert heavy.replace(target={"mass_kg": 50.0}) == mission == mission.replace()
    servicer = mission.to_dict()["servicer"]
    assert mission.replace(servicer=servicer) == mission
    both = mission.replace(horizon={"duration_s": 1300.0}, margins={"keep_out_m": 0.05})
    assert both.duration_s == 1300.0 and both.margins.keep_out_m == 0.05
    assert remora.plan(case, both, integrator="euler").mission == both


BAD = [
    ({"target": {"mas_kg": 60.0}}, r"^mission: target\.mas_kg: unknown field"),
    ({"servicr": {}}, r"^mission: servicr: unknown field"),
    ({"target": {"mass_kg": -60.0}}, r"^mission: target\.mass_kg: "),
    ({"target": {"mass_kg": "heavy"}}, r"^mission: target\.mass_kg: .*expected f64$"),
    ({"target": {"mass_kg": float("nan")}}, r"^mission: target\.mass_kg: is not finite"),
    ({"target": {"mass_kg": object()}}, r"^mission: target\.mass_kg: object cannot be a value of a mission"),
    ({"target": {"inertia_kg_m2": [1.0]}}, r"^mission: target\.inertia_kg_m2"),
    ({"target": 5.0}, r"^mission: target: "),
]


@pytest.mark.parametrize(("changes", "message"), BAD)
def test_a_wrong_change_is_refused_by_its_key(
    mission: remora.Mission, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        mission.replace(**changes)
    with pytest.raises(ValueError, match=message):
        remora.Mission.from_dict(changes)


def test_notebooks_show_plans_scenarios_missions_and_flights(plan: remora.Plan) -> None:
    flights = remora.fly(plan, errors="typical", runs=2)
    assert isinstance(flights, list) and len(flights) == 2
    for shown, words in [
        (plan, ["<svg", "optimal", plan.checksum]),
        (plan.scenario, ["pub-000", "position", "rad/s"]),
        (plan.mission, ["target.mass_kg", "<td>50</td>", "servicer.links[0]"]),
        (flights[0], [flights[0].ending, "miss [mm]"]),
        (flights, ["of 2 flights captured", "<th>1</th>", "<th>run</th>"]),
    ]:
        text = shown._repr_html_()
        assert all(word in text for word in words), text[:500]
        assert "<script" not in text and "http://" not in text.replace("http://www.w3.org/", "")
