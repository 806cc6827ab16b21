"""Bits of runs, which hang neither on the compiler nor on how it optimises."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.native import built

PROGRAM = r"""
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "capsule.h"
enum { RUNS = 200 };
static uint64_t seed = 88172645463325252u;
static double drawn(double low, double high)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return low + (high - low) * (double)(seed >> 11) * 0x1p-53;
}
static void show(const char *name, const capsule_state *states)
{
    uint64_t sum = 1469598103934665603u;
    for (int i = 0; i < RUNS; i++) {
        const double state[3] = {states[i].x_r, states[i].v_r, states[i].v_c};
        unsigned char bytes[sizeof state];
        memcpy(bytes, state, sizeof state);
        for (size_t k = 0; k < sizeof state; k++)
            sum = (sum ^ bytes[k]) * 1099511628211u;
    }
    printf("%s %" PRIx64 "\n", name, sum);
}
int main(void)
{
    static capsule_parameters p[RUNS];
    static capsule_state begun[RUNS], states[RUNS];
    static capsule_stop stops[RUNS];
    static capsule_map map;
    capsule_workspace *workspace = malloc(sizeof *workspace);
    for (int i = 0; i < RUNS; i++) {
        p[i] = (capsule_parameters){.omega = 0.8, .zeta = 0.05, .beta = 1.5, .gamma = 3.3};
        p[i].f_b = 1.0;
        p[i].alpha = drawn(0.8, 2.0);
        p[i].delta = drawn(0.0, 0.3);
        const double x_r = drawn(-1.0, 1.0), v_r = drawn(-1.0, 1.0);
        capsule_map_make(&p[i], &map);
        begun[i] = states[i] = capsule_state_at(&map, x_r, v_r, 0.0, 0.0);
        capsule_request request;
        size_t written;
        capsule_outcome open;
        memset(&request, 0, sizeof request);
        capsule_run(&map, &states[i], 20, &request, &written, &open);
    }
    show("alone", states);
    for (int lanes = 4; lanes <= 8; lanes += 4) {
        memcpy(states, begun, sizeof states);
        const capsule_batch batch = {.parameters = p, .states = states, .stops = stops, .stride = 1,
                                     .lanes = lanes};
        capsule_run_many(&batch, RUNS, 20, workspace);
        show(lanes == 4 ? "4 lanes" : "8 lanes", states);
    }
    return 0;
}
"""
WAYS = (("cc", "-O1"), ("cc", "-O3"), ("clang", "-O1"))


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_runs_have_the_same_bits_from_every_compiler(tmp_path: Path) -> None:
    seen = set()
    for compiler, optimised in WAYS:
        if shutil.which(compiler):
            flags = (optimised, "-Wno-psabi", "-DCAPSULE_ANY_WIDTH=1")
            program = built(tmp_path / f"{compiler}{optimised}", PROGRAM, *flags, compiler=compiler)
            done = subprocess.run([program], capture_output=True, text=True, check=True)
            seen.add(done.stdout)
    assert len(seen) == 1
    _, four, eight = (line.split()[-1] for line in seen.pop().splitlines())
    assert four == eight
