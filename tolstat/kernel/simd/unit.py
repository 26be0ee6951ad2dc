"""Kernels that call each other become machine code once, as one unit: that of the kernel that Python calls.

Numba optimises and emits each function by itself, with a copy of all that it calls: level by level the same code
again. Here a kernel that kernels call stays intermediate code. The one that Python calls takes in each one below it
once, and is optimised, emitted and cached with them as a whole.

This is the one place that leans on Numba's internals. Where they have moved, importing it fails and `_jit` compiles as
Numba does; where they mean something else, ``tests/kernel/test_compilation.py`` fails.
"""

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes, NativeLowering
from numba.core.types import Dispatcher

NEEDED = ("_get_module_for_linking", "_optimize_final_module", "_finalize_final_module", "_raise_if_finalized")
if not all(hasattr(JITCodeLibrary, name) for name in NEEDED):
    raise ImportError("Numba's code libraries are not those that units are written for")


class Unit(JITCodeLibrary):
    """Intermediate code of a kernel; machine code of it and of all below once that is asked for."""

    def add_linking_library(self, library):
        """Remember what is called, as it is."""
        self._linking_libraries.append(library)

    def below(self):
        """Modules of everything that is called from here, directly or not, each once."""
        found, waiting, others = {self}, [self], []
        while waiting:
            for library in waiting.pop()._linking_libraries:
                if library in found:
                    continue
                found.add(library)
                self._reload_init.update(library._reload_init)
                if isinstance(library, Unit) and not library._finalized:
                    waiting.append(library)
                    yield library._final_module
                else:
                    others.append(library)
        for library in others:  # last: the linker takes of these what is called by then, and nothing else
            yield library._get_module_for_linking()

    def finalize(self):
        """Take in everything below, optimise, and emit."""
        self._raise_if_finalized()
        module = self._final_module
        own = {function.name for function in module.functions}
        for other in self.below():
            module.link_in(other, preserve=True)
        for function in module.functions:
            if not function.is_declaration and function.name not in own:
                function.linkage = Linkage.internal  # nobody else calls this copy: what is inlined can go
        self._optimize_final_module()
        module.verify()
        self._finalize_final_module()


@register_pass(mutates_CFG=False, analysis_only=True)
class IntoUnit(LoweringPass):
    """Have a kernel lowered into a `Unit`."""

    _name = "into_unit"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Make the unit."""
        state.library = Unit(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class AnnouncePart(LoweringPass):
    """Tell Numba how a kernel without machine code is called."""

    _name = "announce_part"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Register what was lowered."""
        lowered = state["cr"]
        key = object()  # stands where the function that Python calls does otherwise
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return False


class Whole(Compiler):
    """Compiles a kernel that Python calls."""

    def define_pipelines(self):
        """Numba's, into a unit."""
        (passes,) = super().define_pipelines()
        passes.add_pass_after(IntoUnit, AnnotateTypes)
        passes.finalize()
        return [passes]


class Part(Whole):
    """Compiles a kernel that kernels call."""

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, locals):
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)

    def define_pipelines(self):
        """Numba's, into a unit that is not emitted."""
        (passes,) = super().define_pipelines()
        passes.add_pass_after(AnnouncePart, NativeLowering)
        passes.finalize()
        return [passes]


class Callee(CPUDispatcher):
    """A kernel as kernels see it."""

    def add_overload(self, cres):
        """Keep for type inference; there is nothing that Python could call."""
        self.overloads[tuple(cres.signature.args)] = cres


class Kernel(CPUDispatcher):
    """A kernel as Python sees it."""

    def __init__(self, py_func, locals=None, targetoptions=None, pipeline_class=Whole):
        super().__init__(py_func, locals, targetoptions, pipeline_class)
        self.callee = Callee(py_func, locals, targetoptions, Part)

    @property
    def _numba_type_(self):
        """What it is to a kernel that calls it."""
        return Dispatcher(self.callee)
