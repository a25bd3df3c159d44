//! What the images look like: found, or refused with what differs.

use fieldarm::sim::meca500::RobotSettings;
use fieldarm::wire::order::ByteOrder;

use crate::cell::Cell;
use crate::checkers::End;
use crate::contract::BusKind;
use crate::quick_robot::quick_robot;

pub(crate) fn the_byte_order_is_found_in_every_order(kind: impl BusKind) {
    for byte_order in ByteOrder::ALL {
        let joints = [12.0, -3.0, 4.0, 30.0, -60.0, 500.0];
        let robot = RobotSettings { byte_order, joints, ..quick_robot() };
        let mut cell = Cell::open(kind, robot);
        cell.until("a byte order", 2_000, |cell| {
            let is_settled = cell.plc.engine.byte_order().is_some();
            assert!(is_settled || cell.plc.outputs.iter().all(|byte| *byte == 0), "{cell:#?}");
            is_settled
        });
        assert_eq!(cell.plc.engine.byte_order(), Some(byte_order), "{cell:#?}");
        cell.bring_up();
        let tickets: Vec<_> = (0..20).map(|_| cell.submit_next().unwrap()).collect();
        cell.finish(1_000);
        let done = |ticket| cell.plc.state(ticket).end == Some(End::Done);
        assert!(tickets.into_iter().all(done), "{byte_order}\n{cell:#?}");
    }
}

pub(crate) fn a_foreign_layout_is_refused_by_what_differs(kind: impl BusKind) {
    let (refused, named) = kind.refusal();
    let Err(text) = refused else { panic!("{kind:?} takes images it cannot read") };
    for word in named {
        assert!(text.contains(word), "{kind:?} does not name {word}: {text}");
    }
}
