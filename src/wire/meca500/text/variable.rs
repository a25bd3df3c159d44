//! Robot variables.
//!
//! `CreateVariable` takes cyclic ID 0 for "none"; between 1 and 9999 the robot answers 1552.

use super::spec::{
    Category, CyclicEquivalent as Equivalent, Declared, OFF_ON, TextArgumentKind, TextCommandSpec,
    Timing, command, instantaneous, integer, one_of, optional, other, text,
};
use crate::wire::meca500::command::MotionCommandId as Id;

pub(super) const COMMANDS: &[TextCommandSpec] = &[
    command(
        "CreateVariable",
        Category::Variable,
        Timing::NotStated,
        Declared::Here(&[
            text("name", None),
            other("value", TextArgumentKind::Json),
            optional(integer("cyclicId", 0, 19_999, Some(0.0))),
            optional(one_of("override", OFF_ON, Some(0.0))),
        ]),
        Equivalent::None,
        6866,
    ),
    command(
        "DeleteVariable",
        Category::Variable,
        Timing::NotStated,
        Declared::Here(&[text("name", None)]),
        Equivalent::None,
        6918,
    ),
    instantaneous("GetVariable", Category::Variable, &[text("name", None)], Equivalent::None, 6948),
    command(
        "ListVariables",
        Category::Variable,
        Timing::NotStated,
        Declared::Here(&[]),
        Equivalent::None,
        6978,
    ),
    command(
        "SetVariable",
        Category::Variable,
        Timing::NotStated,
        Declared::Here(&[text("name", None), other("value", TextArgumentKind::Json)]),
        Equivalent::Motion(Id::VARIABLE_FIRST),
        7003,
    ),
];
