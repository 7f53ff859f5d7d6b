from cns_drake.city import name_stem
from cns_drake.city.placement.draft import NameCounter


def test_each_kind_has_numbers_of_its_own():
    names = NameCounter()
    assert names.next_name("tower") == "tower_001"
    assert names.next_name("tower") == "tower_002"
    assert names.next_name("tree") == "tree_001"


def test_a_new_range_begins_after_the_next_multiple_of_50():
    names = NameCounter()
    for _ in range(50):
        names.next_name("tree")
    names.open_range()
    assert names.next_name("tree") == "tree_051"
    names.open_range()
    assert names.next_name("tree") == "tree_101"
    assert names.next_name("bench") == "bench_001"


def test_objects_have_everyday_names():
    assert name_stem("lime_tree") == "tree"
    assert name_stem("sign_stop") == "sign"
    assert name_stem("bus_shelter") == "bus_shelter"
