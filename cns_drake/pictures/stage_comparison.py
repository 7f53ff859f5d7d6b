"""The other stage that a drive's web page shows for comparison."""

from cns_drake.scenarios import CityConfig, Scenario


def other_stage(scenario: Scenario) -> tuple[Scenario | None, str, bool]:
    """Returns a drive's scenario in another stage, and that stage's name.

    The other stage is the map's last stage or, for a drive in the last stage,
    the first stage. If the drive leaves out structures (`without`), or changes
    the city (`city`), the other stage is the drive's own without the change.

    Returns:
        The scenario in the other stage, the stage's name for the page, and
        whether it is the earlier stage; None, "" and False if there is no other
        stage.
    """
    if scenario.city.is_made:
        plain = scenario.with_fields({"city": None}, scenario.source)
        return plain, f"stage {scenario.stage}", True
    if scenario.without or not scenario.city.is_off:
        whole = scenario.replaced(without=(), city=CityConfig())
        return whole, "the whole city", True
    stages = list(scenario.folder.stages())
    others = [stage for stage in stages if stage != scenario.stage]
    if scenario.stage is None or not others:
        return None, "", False
    stage = others[-1] if stages[-1] in others else others[0]
    is_earlier = stages.index(stage) < stages.index(scenario.stage)
    return scenario.replaced(stage=stage), f"stage {stage}", is_earlier
