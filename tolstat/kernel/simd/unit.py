"""Compilation of a kernel that Python calls and of all its callees as one unit, instead of function by function.

Numba optimises and emits each function separately, with a copy of all its callees: the same code again at each level of
calls. Here a kernel that is called by kernels stays intermediate code. The kernel that Python calls links each of its
direct and indirect callees once, and is optimised, emitted and cached together with them.

This module depends on Numba's internals. Where it cannot be imported, `jit` compiles function by function;
``tests/kernel/test_compilation.py`` fails where they change.
"""

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes, NativeLowering, NopythonRewrites
from numba.core.types import Dispatcher, unliteral
from numba.core.untyped_passes import InlineClosureLikes, RewriteSemanticConstants

from tolstat.kernel.simd.absent import DecideConditions

for _method in ("_raise_if_finalized", "_get_module_for_linking", "_optimize_final_module", "_finalize_final_module"):
    getattr(JITCodeLibrary, _method)  # an AttributeError now, not while a kernel is compiled


class Unit(JITCodeLibrary):
    """Intermediate code of a kernel; `finalize` makes machine code of it and of all its callees."""

    def add_linking_library(self, library):
        """Keep the library of a callee without linking it yet."""
        self._linking_libraries.append(library)

    def below(self):
        """Modules of all direct and indirect callees, each once."""
        linked, waiting, others = {self}, [self], []
        while waiting:
            for library in waiting.pop()._linking_libraries:
                if library in linked:
                    continue
                linked.add(library)
                self._reload_init.update(library._reload_init)
                if isinstance(library, Unit) and not library._finalized:
                    waiting.append(library)
                    yield library._final_module
                else:
                    others.append(library)
        for library in others:  # last: the linker takes only functions that are referenced by then
            yield library._get_module_for_linking()

    def finalize(self):
        """Link all callees, optimise, and emit machine code."""
        self._raise_if_finalized()
        module = self._final_module
        before = {function.name for function in module.functions}
        for other in self.below():
            module.link_in(other, preserve=True)
        for function in module.functions:
            if not function.is_declaration and function.name not in before:
                function.linkage = Linkage.internal  # no other code calls this copy: delete it where it is inlined
        self._optimize_final_module()
        module.verify()
        self._finalize_final_module()


@register_pass(mutates_CFG=False, analysis_only=True)
class IntoUnit(LoweringPass):
    """Compiler pass: make the `Unit` that the kernel is lowered into."""

    _name = "into_unit"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Create the unit."""
        state.library = Unit(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class AnnouncePart(LoweringPass):
    """Compiler pass: register a kernel without machine code as callable by other kernels."""

    _name = "announce_part"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        """Register the lowered kernel under a new key."""
        lowered = state["cr"]
        key = object()  # in place of the compiled function, which does not exist
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return False


UNUSED = (InlineClosureLikes, NopythonRewrites)
"""Passes that no kernel needs: for closures, and for arithmetic on whole arrays."""


class Whole(Compiler):
    """Compiler of a kernel that Python calls."""

    def define_pipelines(self):
        """Numba's pipeline, lowering into a `Unit`."""
        (passes,) = super().define_pipelines()
        passes.passes = [one for one in passes.passes if one[0] not in UNUSED]
        passes.add_pass_after(DecideConditions, RewriteSemanticConstants)
        passes.add_pass_after(IntoUnit, AnnotateTypes)
        passes.finalize()
        return [passes]


class Part(Whole):
    """Compiler of a kernel that kernels call."""

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, locals):
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)

    def define_pipelines(self):
        """Numba's pipeline, lowering into a `Unit` without machine code."""
        (passes,) = super().define_pipelines()
        passes.add_pass_after(AnnouncePart, NativeLowering)
        passes.finalize()
        return [passes]


class Callee(CPUDispatcher):
    """Dispatcher of a kernel for calls from kernels."""

    def add_overload(self, cres):
        """Keep the overload for type inference; it has no entry point for Python."""
        self.overloads[tuple(cres.signature.args)] = cres

    def get_call_template(self, args, kws):
        """Resolve a call; a constant integer does not get a version of its own, since LLVM takes calls in anyway."""
        return super().get_call_template([unliteral(a) for a in args], {name: unliteral(a) for name, a in kws.items()})


class Kernel(CPUDispatcher):
    """Dispatcher of a kernel for calls from Python."""

    def __init__(self, py_func, locals=None, targetoptions=None, pipeline_class=Whole):
        super().__init__(py_func, locals, targetoptions, pipeline_class)
        self.callee = Callee(py_func, locals, targetoptions, Part)

    @property
    def _numba_type_(self):
        """Numba type of the kernel inside other kernels."""
        return Dispatcher(self.callee)
