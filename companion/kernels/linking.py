"""Making the library of carried kernels, where a package is built: machine code of all of them, linked by ``ld``.

Each kernel is written by LLVM once more from the form that numba keeps for linking, this time to lie at any address.
All names but two are its own, so that two kernels never share what numba happened to name alike: the function that
Python calls, and the places of its environments. What it calls of numba goes through a table that is filled when it is
loaded.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# isort: off
from companion.kernels.compiled import Compiled  # before the processor is chosen: it says which
# isort: on
import numpy as np
from llvmlite import binding as llvm
from numba.core.registry import cpu_target

from companion.errors import JobError
from companion.kernels.cache import read
from companion.kernels.crew import Work, planned
from companion.kernels.linked import HELPERS, INDEX, LIBRARY, PARTS

_HELPER = re.compile("|".join(prefix for prefix in PARTS.values() if prefix))
_JUMPS = {   # to what the table has at this place: of a processor's family
    "x86_64": "jmp *.Lhelpers+{at}(%rip)",
    "aarch64": "adrp x16, .Lhelpers+{at}\n ldr x16, [x16, :lo12:.Lhelpers+{at}]\n br x16",
}


def link(packages: Sequence[str], folder: Path) -> bool:
    """Link the packages' kernels, compiled before into the folder, to a library there; False where there is no ``ld``.

    Raises:
        JobError: a kernel needs what cannot be linked; CalledProcessError: the linker's own words are on the console.
    """
    linker = shutil.which("ld")
    family = llvm.get_process_triple().partition("-")[0]
    if linker is None or family not in _JUMPS:
        return False
    cpu_target.target_context.refresh()
    llvm.initialize_native_asmparser()
    machine = llvm.Target.from_default_triple().create_target_machine(
        cpu="generic", features="", opt=3, reloc="pic", codemodel="default")
    index: dict[str, Any] = {"helpers": [], "environments": {}, "kernels": {}}
    helpers: set[str] = set()
    with tempfile.TemporaryDirectory() as scratch:
        for number, work in enumerate(planned(packages)):
            module, entry = _module(work, folder, number, machine, index["environments"], helpers)
            Path(scratch, f"{number}.o").write_bytes(machine.emit_object(module))
            index["kernels"].setdefault(f"{work.entry.module}:{work.entry.name}", []).append(entry)
        index["helpers"] = sorted(helpers)
        Path(scratch, "helpers.o").write_bytes(machine.emit_object(_jumps(index["helpers"], family)))
        command: list[str | Path] = [
            linker, "-shared", "-z", "now", "-z", "noexecstack", "--build-id=sha1", "-s", "-o", folder / LIBRARY,
            *sorted(Path(scratch).glob("*.o")), "-l:libm.so.6", "-l:libc.so.6"]
        subprocess.run(command, check=True)  # noqa: S603 - the system's own
    index["sha256"] = hashlib.sha256((folder / LIBRARY).read_bytes()).hexdigest()
    (folder / INDEX).write_text(json.dumps(index, indent=1), encoding="utf-8")
    return True


def _module(
    work: Work, folder: Path, number: int, machine: Any, environments: dict[str, list[str]], helpers: set[str],
) -> tuple[Any, dict[str, str]]:
    """Return a kernel's module under names of its own, and what the index says of it."""
    assert isinstance(work.dispatcher, Compiled)
    payload = read(folder / work.file)
    if payload is None:
        raise JobError(f"{folder / work.file}: the kernel is not there")
    (_, _, (_, bitcode)), described, own, *_, _again, others = pickle.loads(payload)  # noqa: S301 - our own
    constants = {env.env_name: _names(env.consts, work) for env in (own, *others)}
    module = llvm.parse_bitcode(bitcode)
    wrapper = described.llvm_cpython_wrapper_name
    for function in module.functions:
        if function.is_declaration:
            helpers.update([function.name] if _HELPER.match(function.name) else [])
        elif function.name == wrapper:
            function.linkage = "external"
        else:
            function.linkage = "internal"
    places: dict[str, str] = {}
    for variable in module.global_variables:
        if variable.name in constants:   # one that numba has not kept is as empty as where numba loads it
            places[variable.name] = f"kernel_{number}_environment_{len(places)}"
            environments[places[variable.name]] = constants[variable.name]
            variable.linkage = "external"
            variable.name = places[variable.name]
        elif not variable.is_declaration:
            variable.linkage = "internal"
    module.get_function(wrapper).name = f"kernel_{number}"
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(3)))
    return module, {"types": work.entry.signature, "symbol": f"kernel_{number}",
                    "environment": places[described.env_name]}


def _names(constants: Sequence[Any], work: Work) -> list[str]:
    """Return the constants of an environment as the index has them: numpy's types of arrays that are returned."""
    if not all(isinstance(constant, np.dtype) for constant in constants):
        raise JobError(f"{work.entry}: a constant of it cannot be carried: {constants}")
    return [constant.str for constant in constants]


def _jumps(helpers: Sequence[str], family: str) -> Any:
    """Return a module in which every function of numba's is a jump to what the table has for it."""
    lines = [".text"]
    for n, helper in enumerate(helpers):
        lines += [f".globl {helper}", f".hidden {helper}", f".type {helper}, %function", f"{helper}:",
                  *_JUMPS[family].format(at=8 * n).split("\n")]
    lines += [".bss", ".balign 8", f".globl {HELPERS}", f".type {HELPERS}, %object", f"{HELPERS}:", ".Lhelpers:",
              f".zero {8 * max(1, len(helpers))}", f".size {HELPERS}, {8 * max(1, len(helpers))}"]
    return llvm.parse_assembly(
        "\n".join([f'target triple = "{llvm.get_process_triple()}"', *(f'module asm "{line}"' for line in lines)]))
