"""The processor that kernels are compiled for."""

from __future__ import annotations

import pytest

from viewsphere.kernels.build import COMMON, NEEDED, Target

LINUX, ARM = "x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu"
ALL = dict.fromkeys(NEEDED, True)


def target(triple=LINUX, host="znver4", native=False, **features):
    return Target.for_machine(triple, host, ALL | features, native)


def test_processors_of_a_kind_share_one_target():
    assert target() == target(host="haswell", avx512f=True) == target("x86_64-apple-darwin22") == Target(COMMON)
    assert target().note == ""


def test_native_code_is_for_this_processor():
    native = target(native=True, avx512f=True, sse4a=False)
    assert native.cpu == "znver4"
    assert {"+avx512f", "+avx2", "-sse4a"} <= set(native.features.split(","))
    assert native.note == ""


@pytest.mark.parametrize("name", NEEDED)
def test_a_processor_that_lacks_an_instruction_gets_its_own_code_and_says_so(name):
    old = target(host="ivybridge", **{name: False})
    assert old.cpu == "ivybridge" and f"-{name}" in old.features.split(",")
    assert "ivybridge" in old.note and name in old.note


def test_what_llvm_knows_nothing_of_counts_as_lacking():
    assert Target.for_machine(LINUX, "", {}, native=False).lacking == NEEDED


def test_other_processors_get_code_of_their_own():
    arm = Target.for_machine(ARM, "neoverse-n1", {"neon": True}, native=False)
    assert arm == Target("neoverse-n1", "+neon") and arm.note == ""
