//! Variables: names, types, cyclic IDs, and their use as arguments.

use crate::desk::{Desk, codes};

#[test]
fn every_type_is_created_read_set_listed_and_deleted() {
    let mut desk = Desk::connected();
    for (name, value, other) in [
        ("a", "true", "false"),
        ("b.number", "-0.153", "7"),
        ("c.text", "\"Hello, (world)!\"", "\"\""),
        ("d.e.array", "[190.0,0.0,308.9,0,90,0]", "[1,2,3,4,5,6]"),
        ("f", "[true,\"x\",[1]]", "[false,\"yz\",[2.5]]"),
    ] {
        let heard = desk.ask(&format!("CreateVariable({name},{value})"));
        assert_eq!(heard, format!("[2552][{name},{value},0,0]"));
        assert_eq!(desk.ask(&format!("GetVariable({name})")), format!("[2551][{name},{value},0]"));
        let heard = desk.ask(&format!("SetVariable({name},{other})"));
        assert_eq!(heard, format!("[2554][{name},{other}]"));
        assert_eq!(desk.ask(&format!("GetVariable({name})")), format!("[2551][{name},{other},0]"));
    }
    assert_eq!(desk.ask("ListVariables"), "[2550][a,b.number,c.text,d.e.array,f]");
    let saved = desk.robot.variables();
    assert_eq!(desk.ask("DeleteVariable(a)"), "[2553][a]");
    assert_eq!(codes(&desk.say("DeleteVariable(a)")), [1553]);
    assert_eq!(codes(&desk.say("GetVariable(a)")), [1551]);
    assert_eq!(codes(&desk.say("GetVariable(B.number)")), [1551]);
    let mut other = Desk::connected();
    for variable in &saved {
        other.robot.restore_variable(variable).unwrap();
    }
    assert_eq!(other.robot.variables(), saved);
}

#[test]
fn wrong_values_and_names_are_refused_with_a_reason() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(number,1.5)");
    desk.say("CreateVariable(array,[1,2],10000)");
    for (line, wanted) in [
        ("CreateVariable(bad name,1)", 1552),
        ("CreateVariable(1st,1)", 1552),
        ("CreateVariable(a..b,1)", 1552),
        ("CreateVariable(x,null)", 1552),
        ("CreateVariable(x,{\"a\":1})", 1552),
        ("CreateVariable(x,hello)", 1552),
        ("CreateVariable(x,[1,2)", 1002),
        ("CreateVariable(x,1,10000)", 1552),
        ("CreateVariable(x,1,9999)", 1552),
        ("CreateVariable(x,1,20000)", 1003),
        ("CreateVariable(x,true,10001)", 1552),
        ("CreateVariable(x,[1,\"a\"],10001)", 1552),
        ("CreateVariable(x,1e300,10001)", 1552),
        ("CreateVariable(number,true)", 1552),
        ("CreateVariable(number,1,10001)", 1552),
        ("SetVariable(number,true)", 1554),
        ("SetVariable(array,[1])", 1554),
        ("SetVariable(array,3)", 1554),
        ("SetVariable(array,[1,true])", 1554),
        ("SetVariable(nobody,1)", 1554),
    ] {
        let heard = desk.say(line);
        assert_eq!(codes(&heard), [wanted], "{line}: {heard:?}");
        assert!(wanted < 1500 || heard[0].len() > 12, "{heard:?}");
    }
    let deep = format!("CreateVariable(x,{}1{})", "[".repeat(5000), "]".repeat(5000));
    assert_eq!(codes(&desk.say(&deep)), [1552]);
    assert_eq!(desk.ask("ListVariables"), "[2550][array,number]");
}

#[test]
fn override_decides_what_happens_to_an_existing_variable() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(x,1,10005)");
    assert_eq!(desk.ask("CreateVariable(x,2,10005,0)"), "[2552][x,1,10005,0]");
    assert_eq!(desk.ask("CreateVariable(x,[3,4],10006,1)"), "[2552][x,[3,4],10006,1]");
    assert_eq!(desk.robot.variable(10_005), None);
    assert_eq!(desk.robot.variable(10_006), Some(&[3.0, 4.0][..]));
    assert_eq!(desk.ask("CreateVariable(x,\"t\",0,1)"), "[2552][x,\"t\",0,1]");
    assert_eq!(desk.robot.variable(10_006), None);
}

#[test]
fn a_cyclic_id_shows_the_same_variable_to_both_faces() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(x,[0.1,2],10005)");
    assert_eq!(desk.robot.variable(10_005), Some(&[0.1, 2.0][..]));
    desk.robot.set_variable(10_005, &[0.3, -4.0]).unwrap();
    assert_eq!(desk.ask("GetVariable(x)"), "[2551][x,[0.3,-4.0],10005]");
    desk.say("SetVariable(x,[5,6])");
    assert_eq!(desk.robot.variable(10_005), Some(&[5.0, 6.0][..]));
    desk.robot.create_variable(10_007, &[1.5]).unwrap();
    assert_eq!(desk.ask("GetVariable(cyclic10007)"), "[2551][cyclic10007,1.5,10007]");
}

#[test]
fn variables_stand_for_arguments() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(load.m,0.25)");
    desk.say("CreateVariable(load.c,[1,2,3])");
    desk.say("CreateVariable(joints,[1,2,3,4,5,6])");
    desk.say("CreateVariable(on,1)");
    desk.say("CreateVariable(flag,true)");
    assert_eq!(codes(&desk.say("SetEom(vars.on)")), [2052]);
    desk.bring_up();
    desk.say("SetPayload(vars.load.m, *vars.load.c)");
    desk.say("MoveJoints(*vars.joints)");
    desk.until(3012);
    assert_eq!(desk.ask("GetPayload"), "[2192][0.25,1,2,3]");
    assert!((desk.robot.target_joints()[5] - 6.0).abs() < 1e-6);
    desk.say("CreateVariable(copy,vars.load.m)");
    assert!(desk.ask("GetVariable(copy)").contains("0.25"));
    for line in [
        "MoveJoints(*vars.nothing)",
        "MoveJoints(vars.joints)",
        "MoveJoints(*vars.load.m,1,2,3,4,5)",
        "MoveJoints(*vars.load.c)",
        "MoveJoints(*vars.joints,7)",
        "SetEom(vars.flag)",
    ] {
        assert_eq!(codes(&desk.say(line)), [1003], "{line}");
    }
}

#[test]
fn the_vendors_client_manages_variables_in_json() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(old,true)");
    let heard = desk.say("-SetVariablesMonitoring(1)");
    assert_eq!(heard.len(), 2, "{heard:?}");
    assert_eq!(heard[0], "[2555][1]");
    let told: serde_json::Value = serde_json::from_str(&heard[1]).unwrap();
    assert_eq!(told["code"], 3310);
    assert_eq!(told["data"]["vars"]["old"]["val"], true);
    assert!(told["data"]["vars"]["old"]["cyclicId"].is_null());
    let create = r#"CreateVariable({"data": {"name": "g.x", "val": [1, 2, 3], "type": 0, "cyclicId": 10001, "volatile": false, "override": false}, "metaData": null})"#;
    let heard = desk.say(create);
    assert_eq!(heard[1], "[2552][g.x,[1,2,3],10001,0]");
    let told: serde_json::Value = serde_json::from_str(&heard[0]).unwrap();
    assert_eq!(told["data"]["vars"]["g.x"]["cyclicId"], 10001);
    let heard =
        desk.say(r#"SetVariable({"data": {"name": "g.x", "val": [4, 5, 6]}, "metaData": null})"#);
    assert_eq!(heard[1], "[2554][g.x,[4,5,6]]");
    assert_eq!(
        codes(&desk.say(r#"SetVariable({"data": {"name": "g.x", "val": {"a": 1}}})"#)),
        [1554]
    );
    // Set by its cyclic ID: told too.
    desk.robot.set_variable(10_001, &[7.0, 8.0, 9.0]).unwrap();
    assert!(desk.listen_ms(1)[0].contains("[7.0,8.0,9.0]"));
    let heard = desk.say(r#"DeleteVariable({"data": {"name": "g.x"}, "metaData": null})"#);
    assert!(heard[0].starts_with(r#"{"code":3311,"#) && heard[1] == "[2553][g.x]", "{heard:?}");
    assert_eq!(codes(&desk.say(r#"DeleteVariable({"data": {"name": "g.x"}})"#)), [1553]);
    assert_eq!(codes(&desk.say(r#"ConnectionWatchdog({"data": {"timeout": -1}})"#)), [1003]);
    assert_eq!(codes(&desk.say(r#"Home({"data": {}})"#)), [1003]);
}

#[test]
fn variables_survive_a_boot() {
    let mut desk = Desk::connected();
    desk.say("CreateVariable(x,5)");
    desk.say("RebootRobot");
    desk.listen_ms(6000);
    assert_eq!(desk.ask("GetVariable(x)"), "[2551][x,5,0]");
}
