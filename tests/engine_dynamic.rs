//! Dynamic slots: delay, rotation among many types, unknown types, age.

#[path = "support/scripted_robot.rs"]
mod scripted_robot;

use fieldarm::engine::meca500::{Config, SubscribeError};
use fieldarm::time::Duration;
use fieldarm::wire::meca500::dynamic::DynamicType;
use scripted_robot::Bench;

fn knows_up_to_99(ty: u32) -> Option<[f32; 6]> {
    (1..100).contains(&ty).then_some([ty as f32, 1.0, f32::NAN, 0.0, 0.0, 6.0])
}

fn bench() -> Bench {
    let mut bench = Bench::connected(Config::default());
    bench.robot.dynamic = knows_up_to_99;
    bench
}

#[test]
fn four_types_stay_in_their_slots_and_arrive_after_any_delay() {
    for delay in 0..4 {
        let mut bench = bench();
        bench.in_delay = delay;
        let types = [40, 41, 42, 43].map(DynamicType);
        for ty in types {
            bench.engine.subscribe(ty).unwrap();
            assert_eq!(bench.engine.dynamic(ty), None);
        }
        bench.steps(3 + delay);
        let asked = bench.outputs.dynamic_data_configuration.dynamic_data_type_id;
        assert_eq!(asked.map(|ty| ty.get()), [40, 41, 42, 43]);
        for ty in types {
            let reading = bench.engine.dynamic(ty).expect("arrived");
            assert_eq!(reading.value.dynamic_type(), ty);
            assert_eq!(reading.value.values()[0], ty.0 as f32);
            assert_eq!(reading.age, Duration::ZERO);
        }
        bench.steps(50);
        let asked = bench.outputs.dynamic_data_configuration.dynamic_data_type_id;
        assert_eq!(asked.map(|ty| ty.get()), [40, 41, 42, 43], "no slot changes without need");
    }
}

#[test]
fn many_types_take_turns_and_unknown_ones_do_not_block() {
    let mut bench = bench();
    let known: Vec<_> = (30..44).map(DynamicType).collect();
    let unknown = [DynamicType(12_345), DynamicType(777)];
    for ty in known.iter().chain(&unknown) {
        bench.engine.subscribe(*ty).unwrap();
    }
    assert_eq!(bench.engine.subscribe(DynamicType(1)), Err(SubscribeError::Full { max: 16 }));
    bench.steps(200);
    for ty in &known {
        let reading = bench.engine.dynamic(*ty).expect("every type has its turn");
        assert!(reading.age < Duration::from_millis(60), "{ty:?} {:?}", reading.age);
        assert_eq!(reading.value.values()[0], ty.0 as f32);
    }
    for ty in unknown {
        assert_eq!(bench.engine.dynamic(ty), None);
    }
}

#[test]
fn a_value_ages_while_inputs_are_bad_and_goes_with_its_subscription() {
    let mut bench = bench();
    let ty = DynamicType::ACTUAL_JOINT_POSITION;
    bench.engine.subscribe(ty).unwrap();
    bench.engine.subscribe(ty).unwrap();
    bench.steps(5);
    bench.quality = fieldarm::cycle::InputQuality::Stale { age_cycles: 1 };
    bench.steps(7);
    assert_eq!(bench.engine.dynamic(ty).unwrap().age, Duration::from_millis(7));
    bench.engine.unsubscribe(ty);
    assert_eq!(bench.engine.dynamic(ty), None);
    bench.quality = fieldarm::cycle::InputQuality::Fresh;
    bench.steps(2);
    let asked = bench.outputs.dynamic_data_configuration.dynamic_data_type_id;
    assert_eq!(asked.map(|ty| ty.get()), [0; 4]);
    assert_eq!(bench.engine.subscribe(DynamicType::AUTOMATIC), Err(SubscribeError::Automatic));
}

#[test]
fn a_slot_with_another_type_is_not_believed() {
    let mut bench = bench();
    bench.robot.dynamic = |_| None;
    bench.engine.subscribe(DynamicType(40)).unwrap();
    bench.steps(20);
    assert_eq!(bench.engine.dynamic(DynamicType(40)), None);
}
