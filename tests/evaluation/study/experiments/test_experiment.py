"""Fields of experiments."""


def test_lists_of_whole_numbers_can_be_spread(read):
    experiment = read(
        """
        seeds: {from: 3, to: 5, count: 3}
        both: {city: {redraw: {frozen: {from: 1, to: 5, count: 2}}}}
        database: {distractors: {from: 0, to: 1000, count: 3}}
        """
    )
    assert experiment.seeds == (3, 4, 5)
    assert experiment.frozen_redraws == [1, 5]
    assert [type(one) for one in experiment.frozen_redraws] == [int, int]
    values = [
        one.factors["database.distractors"] for one in experiment.conditions
    ]
    assert [(type(one), one) for one in values] == [
        (int, 0),
        (int, 500),
        (int, 1000),
    ]
