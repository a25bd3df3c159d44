//! Dynamic data types against the table typed from the manual, and their values both ways.

use fieldarm::wire::meca500::command::{ConfSign, Payload, Severity, WorkZoneMode};
use fieldarm::wire::meca500::dynamic::{
    ActualConfSign, CollisionObject, DYNAMIC_TYPES, DynamicType, DynamicValue, DynamicView, Eoat,
    EoatStatus, ExternalTool, JointLimitsSource, JointTriple, ObjectGroup, ProductType,
};
use proptest::prelude::*;
use std::collections::HashMap;

type Row = HashMap<String, String>;

fn rows() -> Vec<Row> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/spec/meca500_dynamic_data.csv");
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

fn tri_state(cell: &str) -> Option<bool> {
    match cell {
        "yes" => Some(true),
        "no" => Some(false),
        "" | "unknown" => None,
        other => panic!("{other}"),
    }
}

/// `joint velocity [%]` and `enabled enum{0;1}` to name and unit.
fn name_and_unit(cell: &str) -> (String, String) {
    let (rest, unit) = match cell.split_once(" [") {
        Some((name, unit)) => (name, unit.strip_suffix(']').unwrap()),
        None => (cell, ""),
    };
    let name = rest.split(" enum{").next().unwrap().split(" (").next().unwrap();
    (name.replace(' ', "_"), unit.to_owned())
}

#[test]
fn every_row_of_the_table_is_there_and_nothing_else() {
    let rows = rows();
    assert_eq!(rows.len(), 46);
    assert_eq!(DYNAMIC_TYPES.len(), rows.len());
    let mut compared = 0;
    for (spec, row) in DYNAMIC_TYPES.iter().zip(&rows) {
        let ids = match row["id"].split_once('-') {
            Some((first, last)) => (first.parse().unwrap(), last.parse().unwrap()),
            None => (row["id"].parse().unwrap(), row["id"].parse().unwrap()),
        };
        assert_eq!((spec.id.0, spec.last_id.0), ids);
        let expected_name = match row["name"].as_str() {
            "(not named)" => "Not named",
            "Robot variable with this cyclic ID" => "Robot variable",
            name => name,
        };
        assert_eq!(spec.name, expected_name);
        assert_eq!(spec.available, tri_state(&row["meca500_available"]), "{}", spec.name);
        // The selector 0 has no cell: it is asked for and never reported.
        let rotation =
            if spec.id.0 == 0 { Some(false) } else { tri_state(&row["in_automatic_rotation"]) };
        assert_eq!(spec.in_rotation, rotation, "{}", spec.name);
        assert_eq!(spec.manual_line.to_string(), row["manual_line"], "{}", spec.name);
        for position in 0..6 {
            let cell = row[&format!("value{}", position + 1)].as_str();
            let Some(value) = spec.values.get(position) else {
                assert_eq!(cell, "", "{} value {position}", spec.name);
                continue;
            };
            compared += 1;
            let (name, unit) = name_and_unit(cell);
            assert_eq!(value.unit.symbol(), unit, "{} {}", spec.name, value.name);
            match spec.id.0 {
                3 => assert!(cell.starts_with("serial number")),
                53 => assert!(
                    value.name.contains(&name_and_unit(cell.trim_start_matches("MEGP 25*: ")).0),
                    "{} in {cell}",
                    value.name
                ),
                10_000 => assert!(cell.starts_with(&format!("variable value {}", position + 1))),
                _ => assert_eq!(value.name, name, "{}", spec.name),
            }
        }
    }
    assert_eq!(compared, 173);
}

#[test]
fn lookup_finds_exactly_the_ids_of_the_table() {
    for id in 0..20_100 {
        let expected = DYNAMIC_TYPES.iter().find(|spec| spec.id.0 <= id && id <= spec.last_id.0);
        assert_eq!(DynamicType(id).spec(), expected, "{id}");
    }
    assert_eq!(DynamicType(40).to_string(), "40 (Actual joint position)");
    assert_eq!(DynamicType(39).to_string(), "39");
}

fn view(ty: u32, values: [f32; 6]) -> DynamicView {
    DynamicValue::from_values(DynamicType(ty), values).view(Eoat::None)
}

#[test]
fn views_typed_by_hand() {
    let six = [1., 2., 3., 4., 5., 6.];
    assert_eq!(
        view(1, [11., 3., 84., 1234., 0., 0.]),
        DynamicView::FirmwareVersion { major: 11, minor: 3, patch: 84, build: 1234 }
    );
    assert_eq!(view(2, [4., 0., 0., 0., 0., 0.]), DynamicView::ProductType(ProductType::Meca500R4));
    assert_eq!(view(11, [1., 0., 0., 0., 0., 0.]), DynamicView::JointLimitsCfg(true));
    for (ty, source, joints) in [
        (12, JointLimitsSource::Model, JointTriple::First),
        (13, JointLimitsSource::Model, JointTriple::Last),
        (14, JointLimitsSource::Effective, JointTriple::First),
        (15, JointLimitsSource::Effective, JointTriple::Last),
        (61, JointLimitsSource::Configured, JointTriple::First),
        (62, JointLimitsSource::Configured, JointTriple::Last),
    ] {
        let (min, max) = ([1., 2., 3.], [4., 5., 6.]);
        assert_eq!(view(ty, six), DynamicView::JointLimits { source, joints, min, max });
    }
    assert_eq!(
        view(17, [4., 3., 0., 0., 0., 0.]),
        DynamicView::WorkZoneCfg { severity: Severity::Error, mode: WorkZoneMode::ToolAndLinks }
    );
    assert_eq!(
        view(22, six),
        DynamicView::MotionQueueVelocities {
            joint_vel_percent: 1.,
            joint_acc_percent: 2.,
            cart_lin_vel_mm_per_s: 3.,
            cart_ang_vel_deg_per_s: 4.,
            cart_acc_percent: 5.,
            joint_vel_limit_percent: 6.,
        }
    );
    assert_eq!(
        view(31, [0.5, 1., 2., 3., 0., 0.]),
        DynamicView::Payload(Payload { m: 0.5, c_x: 1., c_y: 2., c_z: 3. })
    );
    let tool = CollisionObject { group: ObjectGroup::Tool, id: 10_000 };
    let link = CollisionObject { group: ObjectGroup::Links, id: 2 };
    assert_eq!(
        view(37, [1., 2., 10_000., 0., 2., 0.]),
        DynamicView::CollisionStatus { collision: true, first: tool, second: link }
    );
    assert_eq!(
        view(38, [1., 2., 10_000., 0., 0., 0.]),
        DynamicView::WorkZoneStatus { breach: true, object: tool }
    );
    assert_eq!(view(40, six), DynamicView::ActualJointPosition(six));
    assert_eq!(view(41, six), DynamicView::ActualPose(six.into()));
    assert_eq!(
        view(45, [-1., 0., 1., -3., 0., 0.]),
        DynamicView::ActualConf {
            c_s: ActualConfSign::Minus,
            c_e: ActualConfSign::Singular,
            c_w: ActualConfSign::Plus,
            c_t: -3,
        }
    );
    assert_eq!(
        view(52, [11., 1., 0., 1., 0., 0.]),
        DynamicView::ExternalToolStatus {
            tool: ExternalTool::Megp25Ls,
            homed: true,
            error: false,
            overheated: true,
        }
    );
    assert_eq!(view(10_400, six), DynamicView::Variable { cyclic_id: 10_400, values: six });
}

#[test]
fn the_serial_number_is_the_integer_of_the_second_value() {
    let serial = 4_000_000_001_u32;
    let slot = DynamicView::SerialNumber(serial).encode();
    assert_eq!(slot.dynamic_type(), DynamicType::SERIAL_NUMBER);
    assert_eq!(slot.raw_bits()[1], serial);
    assert_eq!(slot.values()[0], serial as f32);
    assert_ne!(slot.values()[0] as u32, serial, "the Real cannot hold it: that is the point");
    assert_eq!(slot.view(Eoat::None), DynamicView::SerialNumber(serial));
    // The bits handed in decide, not those of the Real.
    let mut bits = [0; 6];
    bits[1] = 77;
    let slot = DynamicValue::new(DynamicType::SERIAL_NUMBER, [0.0; 6], bits);
    assert_eq!(slot.view(Eoat::None), DynamicView::SerialNumber(77));
}

#[test]
fn nan_means_that_the_robot_chooses_the_posture() {
    assert_eq!(
        view(20, [1., f32::NAN, -1., f32::NAN, 0., 0.]),
        DynamicView::DesiredConf {
            c_s: Some(ConfSign::Plus),
            c_e: None,
            c_w: Some(ConfSign::Minus),
            c_t: None,
        }
    );
    let automatic = DynamicView::DesiredConf { c_s: None, c_e: None, c_w: None, c_t: None };
    let values = automatic.encode().values();
    assert!(values[..4].iter().all(|value| value.is_nan()));
    assert_eq!(values[4..], [0.0, 0.0]);
}

#[test]
fn the_tool_decides_how_type_53_is_read() {
    let slot = DynamicValue::from_values(DynamicType::EOAT_STATUS, [1., 0., 0., 1., -40., 5.5]);
    assert_eq!(
        slot.view(ExternalTool::Megp25E.eoat()),
        DynamicView::EoatStatus(EoatStatus::Gripper {
            holding_part: true,
            desired_opening_reached: false,
            closed: false,
            open: true,
            force_percent: -40.,
            opening_mm: 5.5,
        })
    );
    assert_eq!(
        slot.view(ExternalTool::Mpm500.eoat()),
        DynamicView::EoatStatus(EoatStatus::Valves([true, false]))
    );
    let unknown = DynamicView::Unknown { ty: DynamicType(53), values: slot.values() };
    assert_eq!(slot.view(Eoat::None), unknown);
}

#[test]
fn what_has_no_meaning_is_kept() {
    let six = [1.5, 2., 3., 4., 5., 6.];
    for ty in [0, 4, 7, 10, 16, 26, 27, 28, 35, 72, 73, 9_999, 20_000, u32::MAX] {
        assert_eq!(view(ty, six), DynamicView::Unknown { ty: DynamicType(ty), values: six });
    }
    // Known types with a value outside their choices.
    for ty in [1, 2, 11, 17, 20, 24, 29, 30, 36, 37, 38, 45, 52] {
        assert_eq!(
            view(ty, six),
            DynamicView::Unknown { ty: DynamicType(ty), values: six },
            "{ty}"
        );
    }
}

#[test]
fn every_available_type_has_a_typed_view() {
    for spec in DYNAMIC_TYPES {
        let mut values = [1.0; 6];
        if spec.id == DynamicType::PRODUCT_TYPE {
            values[0] = 3.0;
        }
        if spec.id == DynamicType::EXTERNAL_TOOL_STATUS {
            values[0] = 10.0;
        }
        let typed = DynamicValue::from_values(spec.id, values).view(Eoat::Gripper);
        let is_typed = !matches!(typed, DynamicView::Unknown { .. });
        let expected = spec.available == Some(true) && spec.id != DynamicType::AUTOMATIC;
        assert_eq!(is_typed, expected, "{}", spec.name);
        // Exactly the values of the table come back; the others become 0.
        if is_typed {
            let encoded = typed.encode();
            assert_eq!(encoded.dynamic_type(), spec.id);
            let back = encoded.values();
            let used = spec.values.len();
            assert_eq!(back[used..], [0.0; 6][used..], "{}", spec.name);
            if spec.id != DynamicType::SERIAL_NUMBER {
                assert_eq!(back[..used], values[..used], "{}", spec.name);
            }
        }
    }
}

proptest! {
    #[test]
    fn a_view_survives_the_wire(
        ty in prop_oneof![0_u32..80, 9_990_u32..20_010, any::<u32>()],
        values in prop::array::uniform6(prop_oneof![
            any::<f32>(), (-2_i32..25).prop_map(|n| n as f32), Just(f32::NAN), Just(10_000.0),
        ]),
        eoat in prop_oneof![Just(Eoat::None), Just(Eoat::Gripper), Just(Eoat::Valves)],
    ) {
        let ty = DynamicType(ty);
        let view = DynamicValue::from_values(ty, values).view(eoat);
        let slot = view.encode();
        prop_assert_eq!(slot.dynamic_type(), ty);
        let again = slot.view(eoat);
        // Compared by their bits, since NaN values occur.
        prop_assert_eq!(again.encode(), slot);
        if let DynamicView::Unknown { values: kept, .. } = view {
            prop_assert_eq!(kept.map(f32::to_bits), values.map(f32::to_bits));
        }
    }
}
