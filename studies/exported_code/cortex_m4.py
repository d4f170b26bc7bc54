"""Size of code, memory and instructions of exported controllers on a Cortex-M4, in QEMU: `python -m studies.exported_code.cortex_m4`.

Needs arm-none-eabi-gcc with newlib, and qemu-system-arm. The emulator counts instructions, not cycles: an M4 takes one cycle for most, 14 for a
division and some more where its memory waits.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from smajax.core.runtime import prepare

prepare()

from smajax.control.loop_around import loop_around  # noqa: E402
from smajax.core.files import json_text, replace  # noqa: E402
from smajax.export.single_precision import DOUBLE, SINGLE  # noqa: E402
from smajax.export.source import CSource, arithmetic_macro  # noqa: E402
from smajax.model.rigs import arm  # noqa: E402
from studies.exported_code.run import source_of  # noqa: E402

CASES = [
    ("pid", ""),
    ("vsc3", ""),
    ("sld", "printed"),
    ("backstepping1", "printed"),
    ("backstepping2", "printed"),
    ("pid", "model"),
    ("sld", "model"),
]
TARGET = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
FLAGS = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-DSMAJAX_SINGLE=1", "-ffunction-sections", *TARGET]
CLOCK = 168e6  # Hz
CALLS = 200

LINKER = """
MEMORY { ROM (rx) : ORIGIN = 0x00000000, LENGTH = 4M   RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) *(.init) *(.fini) KEEP(*(.init_array)) } > ROM
  .ARM.exidx : { *(.ARM.exidx*) } > ROM
  .data : { *(.data*) } > RAM
  .bss : { *(.bss*) *(COMMON) end = .; } > RAM
  top = ORIGIN(RAM) + LENGTH(RAM);
}
"""
# SysTick counts down once every 40 instructions: QEMU's clock is 1 ns an instruction under -icount shift=0, and the board's 25 MHz.
BOARD = """
#include <stdint.h>
#include "own.h"
extern uint32_t top;
void reset(void);
__attribute__((section(".vectors"), used)) static void *const vectors[] = {&top, (void *)reset};
static volatile uint32_t *const TICK = (uint32_t *)0xE000E010;
static void say(const char *text)
{
    register int call __asm__("r0") = 4;
    register const char *what __asm__("r1") = text;
    __asm__ volatile("bkpt 0xAB" : "+r"(call) : "r"(what) : "memory");
}
static void number(uint32_t value)
{
    char text[12];
    int at = 11;
    text[11] = 0;
    do { text[--at] = (char)('0' + value % 10); value /= 10; } while (value);
    say(&text[at]);
    say("\\n");
}
static own_state state;
static void __attribute__((noinline, noreturn)) measure(void)
{
    uint32_t most = 0, sum = 0;
    TICK[1] = 0xFFFFFF;
    TICK[2] = 0;
    TICK[0] = 5;
    own_init(&state);
    for (int k = 0; k < CALLS; k++) {
        const own_real reading = -0.7f + 0.005f * (own_real)k;
        const uint32_t before = TICK[2];
        own_step(&state, reading, 0.2f);
        const uint32_t took = (before - TICK[2]) & 0xFFFFFF;
        sum += took;
        most = took > most ? took : most;
    }
    number(sum);
    number(most);
    {
        static const uint32_t end[2] = {0x20026, 0};
        register int call __asm__("r0") = 0x18;
        register uint32_t what __asm__("r1") = end[0];
        __asm__ volatile("bkpt 0xAB" : "+r"(call) : "r"(what) : "memory");
    }
    for (;;) { }
}
void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xF << 20; /* the floating-point unit on, before anything is pushed of it */
    __asm__ volatile("dsb; isb" ::: "memory");
    measure();
}
"""


def measured(source: CSource, arithmetic: str) -> dict[str, Any]:
    """Bytes of code, state and stack, and instructions a call, of single inputs and outputs."""
    folder = Path(tempfile.mkdtemp())
    files = {"own.h": source.header, "own.c": source.source, "board.c": BOARD, "board.ld": LINKER}
    for name, text in files.items():
        (folder / name).write_text(text)

    def said(*command: str) -> str:
        return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout

    flags = [*FLAGS, f"-D{arithmetic_macro(source.name)}={int(arithmetic == SINGLE)}"]
    said("arm-none-eabi-gcc", *flags, "-fstack-usage", "-c", "own.c", "-o", "own.o")
    size = said("arm-none-eabi-size", "own.o").splitlines()[1].split()
    stacks = [int(line.split("\t")[1]) for line in (folder / "own.su").read_text().splitlines()]
    link = ["-nostartfiles", "--specs=nosys.specs", "-T", "board.ld", "-Wl,--gc-sections"]
    board = [one for one in flags if one not in ("-std=c99",)] + ["-std=gnu99", f"-DCALLS={CALLS}"]
    said("arm-none-eabi-gcc", *board, "board.c", "own.o", *link, "-o", "board.elf", "-lm")
    linked = said("arm-none-eabi-size", "board.elf").splitlines()[1].split()
    machine = ["qemu-system-arm", "-M", "mps2-an386", "-cpu", "cortex-m4", "-nographic", "-icount", "shift=0"]
    told = subprocess.run(
        [*machine, "-semihosting-config", "enable=on,target=native", "-kernel", "board.elf"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    ticks = [int(one) for one in re.findall(r"^\d+$", told.stdout + told.stderr, re.MULTILINE)]
    mean, most = (40 * ticks[0] / CALLS, 40 * ticks[1]) if len(ticks) == 2 else (None, None)
    return {
        "arithmetic": arithmetic,
        "code_bytes": int(size[0]),
        "code_bytes_with_math": int(linked[0]),
        "state_bytes": source.state_bytes[arithmetic],
        "largest_stack_frame_bytes": max(stacks),
        "instructions_mean": mean,
        "instructions_most": most,
        "milliseconds_most": None if most is None else 1e3 * most / CLOCK,
    }


def main() -> None:
    rows = []
    for name, estimator in CASES:
        source = source_of(loop_around(arm(), name, estimator=estimator or None), name)
        for arithmetic in (SINGLE, DOUBLE):
            rows.append({"controller": name, "estimator": estimator, **measured(source, arithmetic)})
            print(rows[-1], flush=True)
        replace(Path(__file__).with_name("cortex_m4.json"), json_text({"compiler": _compiler(), "rows": rows}))


def _compiler() -> str:
    return subprocess.run(
        ["arm-none-eabi-gcc", "--version"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[0]


if __name__ == "__main__":
    main()
