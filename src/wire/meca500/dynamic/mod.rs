//! Dynamic data: the four slots of the input image whose meaning the PLC chooses.
//!
//! Read [`DYNAMIC_TYPES`] first: one row for each DynamicTypeID of Table 12 with its six values and
//! their units. A slot carries a [`DynamicType`] and six Reals, together a [`DynamicValue`];
//! [`DynamicValue::view`] gives them types, [`DynamicView::encode`] is the way back.
//!
//! Invariants: no type is an error. What has no entry, or holds a value without a meaning, is
//! [`DynamicView::Unknown`] with all it carried; a real robot was seen sending a reserved type.
//!
//! Left out: which slot asks for what and how old a value is (the engine), and the order of the
//! automatic rotation, which the manual does not tell.

mod id;
mod table;
mod tool;
mod value;
mod view;

pub use id::DynamicType;
pub use table::{DYNAMIC_TYPES, DynamicTypeSpec, DynamicValueSpec};
pub use tool::{CollisionObject, Eoat, EoatStatus, ExternalTool, ObjectGroup};
pub use value::DynamicValue;
pub use view::{ActualConfSign, DynamicView, JointLimitsSource, JointTriple, ProductType};
