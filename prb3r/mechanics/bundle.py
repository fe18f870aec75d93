"""Bundles of arrays that kernels hand to each other by address.

Numba passes a NamedTuple as all the numbers that describe its arrays, ten for each array, packed and unpacked in every
caller and every function; that was most of what there was to compile.  A NamedTuple class that is marked as a `bundle`
lies in memory once, where the call from Python puts it, inner bundles included.  Functions are passed its address, and
read from it the description of an array or the address of an inner bundle.  A bundle does not change while it is in use
(the contents of its arrays may), which the compiler is told.
"""

from typing import Any, TypeVar

from numba.core import cgutils, types
from numba.core.cgutils import ir
from numba.core.datamodel import models, register_default
from numba.core.pythonapi import NativeValue
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    typeof_impl,
    unbox,
)

Class = TypeVar("Class", bound=type)


class Bundle(types.Type):
    """Numba's type of a bundle, given by its NamedTuple class and the types of its fields."""

    _code: int  # Numba's own number of a type

    def __init__(self, made_by: Any, members: tuple[types.Type, ...]):
        self.made_by, self.members = made_by, members
        super().__init__(f"{made_by.__name__}({', '.join(map(str, members))})")

    @property
    def key(self):
        return self.made_by, self.members

    @property
    def mangling_args(self):
        return f"{self.made_by.__name__}{self._code}", ()

    def place(self, field: str) -> int:
        """Position of a field, by its name, among the fields of the bundle's class, from 0."""
        return self.made_by._fields.index(field)


def bundle(cls: Class) -> Class:
    """Class decorator: mark a NamedTuple class as a bundle; its fields are arrays or other bundles."""
    typeof_impl.register(cls)(lambda value, context: Bundle(cls, tuple(typeof_impl(part, context) for part in value)))
    return cls


@register_default(Bundle)
class BundleModel(models.PrimitiveModel):
    """Representation of a bundle in compiled code: the address of its fields, one behind the other."""

    def __init__(self, manager, kind: Bundle):
        self.members = [manager.lookup(member) for member in kind.members]
        layout: list[Any] = [
            member.layout if isinstance(member, BundleModel) else member.get_value_type() for member in self.members
        ]
        self.layout: ir.LiteralStructType = ir.LiteralStructType(layout)
        super().__init__(manager, kind, self.layout.as_pointer())


@infer_getattr
class BundleFields(AttributeTemplate):
    key = Bundle

    def generic_resolve(self, value, attr):  # type: ignore[override]
        kind, field = value, attr
        return kind.members[kind.place(field)] if field in kind.made_by._fields else None


@lower_getattr_generic(Bundle)
def field_of_bundle(context, builder, kind, address, field):
    """Generate code that reads a field of a bundle: the description of an array, or the address of an inner bundle."""
    place = kind.place(field)
    there = cgutils.gep_inbounds(builder, address, 0, place)
    return there if isinstance(kind.members[place], Bundle) else builder.load(there)


@unbox(Bundle)
def bundle_from_python(kind, obj, c):
    """Generate code that writes the descriptions of a NamedTuple's arrays to memory that lasts as long as the call."""
    address = cgutils.alloca_once(c.builder, c.context.data_model_manager[kind].layout)
    failed = cgutils.alloca_once_value(c.builder, cgutils.false_bit)
    _describe(kind, obj, address, failed, c)
    return NativeValue(address, is_error=c.builder.load(failed))


def _describe(kind, obj, address, failed, c):
    """Generate code that writes the description of each field of `obj` at `address`, or sets `failed`."""
    for place, member in enumerate(kind.members):
        there, part = cgutils.gep_inbounds(c.builder, address, 0, place), c.pyapi.tuple_getitem(obj, place)
        if isinstance(member, Bundle):
            _describe(member, part, there, failed, c)
            continue
        native = c.unbox(member, part)
        c.builder.store(native.value, there)
        c.builder.store(c.builder.or_(c.builder.load(failed), native.is_error), failed)


@intrinsic
def alike(typingctx, bundle, fields):
    """A bundle of the same class as `bundle`, with the tuple `fields` as its fields; for compiled code."""
    kind = Bundle(bundle.made_by, tuple(fields))

    def code(context, builder, signature, values):
        address = cgutils.alloca_once(builder, context.data_model_manager[kind].layout)
        for place, member in enumerate(kind.members):
            value, there = builder.extract_value(values[1], place), cgutils.gep_inbounds(builder, address, 0, place)
            builder.store(builder.load(value) if isinstance(member, Bundle) else value, there)
        return address

    return kind(bundle, fields), code
