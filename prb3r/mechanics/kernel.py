"""How kernels are compiled: each entrance, which Python calls, together with all kernels that it calls.

Kernels call each other ten deep.  By default Numba optimises a function together with all that it calls, once more in
each of its callers, and wraps each for calls from Python, which takes most of the time to compile.  Here a `kernel` is
only translated; an `entrance` is optimised once, with all that it contains.

Where machine code is kept is described in `code_cache.py`.
"""

import contextlib
import gc
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from numba.core import config, typed_passes, untyped_passes
from numba.core.caching import FunctionCache
from numba.core.cgutils import ir
from numba.core.codegen import JITCodeLibrary
from numba.core.codegen import ll as llvm
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.lowering import Lower
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

from prb3r.mechanics.code_cache import once_at_a_time, one_after_another, own_folder

OPTIONS: dict[str, Any] = {
    "nopython": True,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
    "_nrt": False,
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}
"""No division checks: divisions follow IEEE rules.  NaN and infinity stay visible, so that a failed solve can be told
from a good one."""
EFFORT: dict[str, Any] = {"opt": 1, "loop_vectorize": False, "slp_vectorize": False}
"""Optimisations of LLVM.  Loops are a few rounds long, so vectorising them gains nothing; and kernels are as fast after
the first level of optimisation as after the third (`docs/speed.md`)."""
PART = OPTIONS | {"no_cpython_wrapper": True}
"""Numba's options for kernels that compiled code alone calls."""


class _Entire(JITCodeLibrary):
    """The code of an entrance: optimised with `EFFORT`, and with its parts private to it.

    Numba would share parts by their names, so that of two entrances loaded from disk the second runs parts of the
    first where names are equal; and names hold numbers that each process assigns anew.
    """

    def _optimize_functions(self, ll_module):
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            passes, builder = self._codegen._function_pass_manager(**EFFORT)
            passes.run(function, builder)

    def _optimize_final_module(self):
        for function in self._final_module.functions:
            if function.linkage == llvm.Linkage.linkonce_odr:
                function.linkage = llvm.Linkage.internal
        passes, builder = self._codegen._module_pass_manager(**EFFORT)
        passes.run(self._final_module, builder)


class _Part(_Entire):
    """The code of a kernel, which becomes part of an entrance: it is neither loaded nor optimised by itself."""

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True


class _Lower(Lower):
    """Translation to LLVM in which arguments that are bundles are marked as not aliased (`noalias`)."""

    def setup_function(self, fndesc):
        super().setup_function(fndesc)
        for argument in self.function.args:
            if isinstance(argument.type, ir.PointerType) and isinstance(argument.type.pointee, ir.LiteralStructType):
                argument.add_attribute("noalias")


@register_pass(mutates_CFG=True, analysis_only=False)
class _EntranceLowering(NativeLowering):
    """The pass that translates a function which Python calls."""

    _name = "lowering_to_entrance"
    lowering_class = _Lower

    def run_pass(self, state):
        state.library = _Entire(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().run_pass(state)


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """The pass that translates a function for its callers, which take it from its library."""

    _name = "lowering_to_part"
    lowering_class = _Lower

    def run_pass(self, state):
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        key = object()  # stands for the loaded function, by which callers know the code
        state.cr = state.cr._replace(cfunc=key)
        state.targetctx.insert_user_function(key, state.cr.fndesc, [state.library])
        return True


PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.AnnotateTypes,
)
"""Numba's passes that kernels need before they are lowered: no closures, no inlining or unrolling of its own, no
expressions of whole arrays."""


class _FlagsAsSet(Flags):
    """Flags that compare equal by the values that were set, without asking each for its default.

    Numba uses them as a key to look up what a call resolves to, hundreds of times per kernel, so this saves time.
    """

    def __hash__(self):
        return hash(type(self))

    def __eq__(self, other):
        return self._values == getattr(other, "_values", None) or super().__eq__(other)


def _compiler(lowering: type[NativeLowering]) -> type[CompilerBase]:
    """A compiler class with the `PASSES` that kernels need, followed by the pass `lowering`."""

    class Compiler(CompilerBase):
        def __init__(self, typingctx, targetctx, library, args, return_type, flags, locals):
            super().__init__(typingctx, targetctx, library, args, return_type, _FlagsAsSet(flags), locals)

        def define_pipelines(self):
            pipeline = PassManager("kernel")
            for step in (*PASSES, lowering, typed_passes.NoPythonBackend):
                pipeline.add_pass(step, step.__name__)
            pipeline.finalize()
            return [pipeline]

    return Compiler


_ENTRANCE_COMPILER, _COMPILER = _compiler(_EntranceLowering), _compiler(_PartLowering)


class _Kernel(CPUDispatcher):
    """A function that only compiled code can call."""

    def add_overload(self, cres):
        self.overloads[tuple(cres.signature.args)] = cres

    in_lanes: Any = None
    """The kernel that is called instead where an argument is in lanes, if any; see `lanes/`."""

    def where_in_lanes(self, function):
        """Decorator: compile `function` as the kernel that is called instead where an argument is in lanes."""
        self.in_lanes = kernel(function)
        return self.in_lanes

    def get_call_template(self, args, kws):
        if self.in_lanes is None or not any(getattr(kind, "in_lanes", False) for kind in args):
            return super().get_call_template(args, kws)
        template = self.in_lanes.get_call_template(args, kws)
        self.overloads.update(self.in_lanes.overloads)
        return template

    def _compile_for_args(self, *args, **kws):
        raise TypeError(f"{self.py_func.__name__} is called by compiled code alone; entrance(it.py_func) can be called")


def kernel(function):
    """Decorator: compile `function` as part of every entrance that calls it, directly or not; see `OPTIONS`."""
    return _Kernel(py_func=function, targetoptions=PART, pipeline_class=_COMPILER)


@contextlib.contextmanager
def no_collection() -> Iterator[None]:
    """Switch Python's garbage collector off for the time of the context.

    Compiling leaves little garbage between millions of objects that are still needed, so searching is a waste of time.
    """
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


class _SharedCache(FunctionCache):
    """The machine code of one entrance on disk, for several types of arguments, saved by one process at a time.

    Numba reads the list of types, chooses a file that no other type has, and writes the list.  Two processes that do so
    at the same time for two types would choose the same file, and later ones would run code of the wrong type.
    """

    def save_overload(self, sig, data):
        with one_after_another(Path(own_folder()) / f"{self._py_func.__name__}.list.lock"):
            super().save_overload(sig, data)


class _Entrance(CPUDispatcher):
    """A function that Python calls, compiled when it is first called with arguments of given types."""

    def enable_caching(self):
        self._cache = _SharedCache(self.py_func)

    def compile(self, sig):
        kind = hashlib.sha256(f"{self.py_func.__module__}.{self.py_func.__qualname__}{sig}".encode()).hexdigest()[:16]
        with once_at_a_time(Path(own_folder()) / f"{kind}.lock"), no_collection():
            return super().compile(sig)


def entrance(function):
    """Decorator: compile `function`, with all kernels that it calls, for calls from Python; keep the code on disk."""
    folder = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = own_folder()  # type: ignore[attr-defined]
    try:
        compiled = _Entrance(py_func=function, targetoptions=OPTIONS, pipeline_class=_ENTRANCE_COMPILER)
        compiled.enable_caching()
        return compiled
    finally:
        config.CACHE_DIR = folder  # type: ignore[attr-defined]
