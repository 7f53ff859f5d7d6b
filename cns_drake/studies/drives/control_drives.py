"""Control drives, which show what another route costs without any change."""

from cns_drake.scenarios import Scenario


def control_drive(drive: Scenario, stage: str) -> Scenario:
    """Returns a copy of a drive that goes through another stage of the map.

    Route and driver stay the same. The copy and the usual drive of the other
    stage go through the same city, so a comparison of these two drives shows
    only the effect of the route.

    Args:
        drive: the drive.
        stage: the other stage of its map.
    """
    return with_fixed_driver(drive).replaced(
        name=f"{drive.name}_stage_{stage}",
        stage=stage,
        title=f"Control: the route of {drive.name} in stage {stage}",
    )


def with_fixed_driver(drive: Scenario) -> Scenario:
    """Returns a drive whose driver stays the same if the drive is renamed.

    A driver without a seed is sampled by the name of the drive.
    """
    driver = drive.driver
    if driver.departs and driver.seed is None:
        return drive.replaced(driver=driver.replaced(seed=drive.name))
    return drive
