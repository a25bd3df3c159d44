//! Nothing in the adapter takes memory; here the path of every cycle, and opening and closing.

use fieldarm::bus::enip::adapter::{Adapter, MAX_TRANSMIT_LEN};

use crate::support::{Robot, close_request, io_frame, ms, owner, packet, peer, rr_data};

#[test]
fn neither_cycles_nor_requests_take_memory() {
    let mut robot = Robot::new();
    let session = robot.session(peer(1));
    let id = robot.open(session, &owner("07 00")).o2t_id;
    let request = |message: &[u8]| packet(0x6F, session.handle, &rr_data(message, &[]));
    let (open, close) = (request(&owner("08 00")), request(&close_request("07 00")));
    let frames: Vec<_> = (1..1_001_u32)
        .map(|number| {
            let mut data = vec![1, 0, 0, 0];
            data.extend([number as u8; 60]);
            io_frame(id, (number, number as u16), &data)
        })
        .collect();
    let mut room = [0; MAX_TRANSMIT_LEN];
    let mut produced = 0;
    let mut now = robot.now;
    let adapter = &mut robot.adapter;
    let taken = allocation_counter::measure(|| {
        for (number, frame) in frames.iter().enumerate() {
            now += ms(10);
            adapter.set_inputs(&[number as u8; 252], &[0; 252]);
            adapter.handle_timeout(now);
            adapter.handle_io_datagram(now, peer(1), frame);
            while adapter.poll_transmit(now, &mut room).is_some() {
                produced += 1;
            }
            while adapter.poll_event().is_some() {}
            assert_eq!(adapter.outputs().and_then(|image| image.first()), frame.last());
        }
        adapter.handle_stream(now, session.stream, &close);
        adapter.handle_stream(now, session.stream, &open);
        while adapter.poll_transmit(now, &mut room).is_some() {}
    });
    assert_eq!(produced, 1_000);
    assert!(adapter.owner().is_some_and(|owner| owner.triad.connection_serial == 8));
    assert_eq!(taken.count_total, 0);
}

#[test]
fn an_adapter_is_as_large_as_it_says() {
    let size = size_of::<Adapter>();
    assert!((25_000..35_000).contains(&size), "{size} bytes");
}
