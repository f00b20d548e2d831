//! Tests that the arm's kinematic chain and its MuJoCo model agree.

use crate::common::shipped::anywhere;
use palpate::math::seed;
use palpate::robot::arm::{ArmSettings, Chain, Joints};
use palpate::sim::{Environment, Scene};
use std::path::Path;

fn environment(arm: Option<ArmSettings>) -> Environment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let mut scene = Scene::load(&path, &[]).unwrap();
    scene.arm = arm;
    scene.effects.wrench = Some(Default::default());
    Environment::build(scene).unwrap()
}

fn arm(model: &str) -> ArmSettings {
    ArmSettings {
        model: model.into(),
        base_position_m: Some([0.1, -0.05, 0.2]),
        base_rotation_deg: [5.0, -10.0, 30.0],
        ..Default::default()
    }
}

/// Chains under test: both link sets on a displaced base, and the stage.
fn chains() -> [(Environment, Chain); 3] {
    [Some(arm("pa10")), Some(arm("pa10_a")), None].map(|arm| {
        let environment = environment(arm);
        let chain = environment.chain().unwrap();
        (environment, chain)
    })
}

/// Flange heights at q = 0, metres: mlogoth/PA10 `pa10_csl.urdf.xacro` (C), OpenHRP3
/// `pa10.main.wrl` (A).
#[test]
fn upright_flange_heights_are_the_published_ones() {
    for (model, height_m) in [("pa10", 1.317), ("pa10_a", 1.345)] {
        let mut chain = ArmSettings { model: model.into(), ..Default::default() }.chain().unwrap();
        chain.tool = nalgebra::Isometry3::identity();
        let x = chain.forward(&Joints::zeros());
        assert!((x.translation.vector - nalgebra::Vector3::z() * height_m).norm() < 1e-12);
        assert!(x.rotation.angle() < 1e-12);
    }
}

#[test]
fn jacobian_is_the_central_difference() {
    let step = 1e-6;
    let mut random = seed::stream(1, 0, "jacobian");
    for (_, chain) in chains() {
        for _ in 0..200 {
            let q = anywhere(&chain, &mut random);
            let (x, jacobian) = chain.jacobian(&q);
            for i in 0..7 {
                let mut dq = Joints::zeros();
                dq[i] = step;
                let (above, below) = (chain.forward(&(q + dq)), chain.forward(&(q - dq)));
                let linear = (above.translation.vector - below.translation.vector) / (2.0 * step);
                let angular = (above.rotation * below.rotation.inverse()).scaled_axis();
                let column = jacobian.column(i);
                assert!((column.fixed_rows::<3>(0) - linear).norm() < 1e-8, "joint {i}");
                assert!((column.fixed_rows::<3>(3) - angular / (2.0 * step)).norm() < 1e-8);
            }
            assert!((x.translation.vector - chain.forward(&q).translation.vector).norm() == 0.0);
        }
    }
}

#[test]
fn at_home_the_finger_is_in_front_of_the_zone_and_has_its_pitch() {
    for (_, chain) in
        [environment(Some(ArmSettings::default())), environment(None)].map(|environment| {
            let chain = environment.chain().unwrap();
            (environment, chain)
        })
    {
        let x = chain.forward(&chain.home);
        let attitude = palpate::robot::finger::Finger::default().r_at();
        assert!(x.rotation.angle_to(&attitude) < 1e-9);
        assert!(x.translation.x.abs() < 1e-9);
        assert!((-0.65..-0.5).contains(&x.translation.y), "{}", x.translation.y);
        assert!((0.44..0.56).contains(&x.translation.z), "{}", x.translation.z);
    }
}

#[cfg(feature = "mujoco")]
mod mujoco {
    use super::{anywhere, arm, chains, environment};
    use mujoco_rs::wrappers::MjModel;
    use mujoco_rs::wrappers::mj_data::MjData;
    use mujoco_rs::wrappers::mj_model::MjtObjBase;
    use nalgebra::{Vector3, Vector6};
    use palpate::backend::{Fault, Wrench};
    use palpate::math::seed;
    use palpate::robot::arm::ArmSettings;
    use palpate::sim::Environment;
    use palpate::sim::mjcf;
    use palpate::sim::mjcf::ModelPurpose;
    use palpate::sim::mujoco::{Plant, compile};
    use std::sync::Arc;

    const STEP_S: f64 = 0.002;

    fn model(environment: &Environment) -> MjModel {
        compile(&mjcf::scene(environment, ModelPurpose::Dynamic { step_s: STEP_S }).unwrap())
            .unwrap()
    }

    fn plant(arm: Option<ArmSettings>) -> (Plant, Vec<f64>) {
        let environment = environment(arm);
        let chain = environment.chain().unwrap();
        let home = chain.home.as_slice()[..chain.joints.len()].to_vec();
        let mut plant = Plant::new(Arc::new(model(&environment))).unwrap();
        plant.reset(&home).unwrap();
        (plant, home)
    }

    #[test]
    fn forward_kinematics_and_jacobian_equal_mujocos() {
        let mut random = seed::stream(1, 0, "kinematics");
        for (environment, chain) in chains() {
            let model = model(&environment);
            let tip = model.name_to_id(MjtObjBase::mjOBJ_SITE, "tip").unwrap();
            let mut data = MjData::new(&model);
            let n = chain.joints.len();
            for _ in 0..1000 {
                let q = anywhere(&chain, &mut random);
                data.qpos_mut().copy_from_slice(&q.as_slice()[..n]);
                data.forward();
                let (x, jacobian) = chain.jacobian(&q);
                let p = Vector3::from(data.site_xpos()[tip]);
                assert!((p - x.translation.vector).norm() < 1e-9);
                let r = nalgebra::Matrix3::from_row_slice(&data.site_xmat()[tip]);
                assert!((r - x.rotation.to_rotation_matrix().into_inner()).norm() < 1e-9);
                let (linear, angular) = data.jac_site(true, true, tip);
                for (row, col) in (0..3).flat_map(|row| (0..n).map(move |col| (row, col))) {
                    assert!((jacobian[(row, col)] - linear[row * n + col]).abs() < 1e-9);
                    assert!((jacobian[(row + 3, col)] - angular[row * n + col]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn names_and_stops_of_chain_and_model_agree() {
        for (environment, chain) in &chains()[..2] {
            let model = model(environment);
            for (i, joint) in chain.joints.iter().enumerate() {
                let id = model.name_to_id(MjtObjBase::mjOBJ_JOINT, &joint.name);
                assert_eq!(id, Some(i), "{}", joint.name);
                // The stop is 3 degrees beyond the servo's limit.
                let stop = joint.q_limits[1] + 3.0_f64.to_radians();
                assert!((model.jnt_range()[i][1] - stop).abs() < 1e-6, "{}", joint.name);
                assert_eq!(model.name_to_id(MjtObjBase::mjOBJ_ACTUATOR, &joint.name), Some(i));
            }
        }
    }

    /// S2 gravity torque with the arm horizontal and without a finger, N m: set A from the masses
    /// of Siconos `HuMAns_pa10/.../pa10-old/robotmodel.h`, set C from `DynamicData.maple` with
    /// the centre of mass of W1 behind its axis.
    #[test]
    fn gravity_torque_at_the_shoulder_is_the_published_arms() {
        let files = [
            (include_str!("../../models/pa10/a.xml"), 80.7),
            (include_str!("../../models/pa10/c.xml"), 92.6),
        ];
        for (text, expected_nm) in files {
            let model = compile(text).unwrap();
            let mut data = MjData::new(&model);
            data.qpos_mut()[1] = std::f64::consts::FRAC_PI_2;
            data.forward();
            let torque_nm = data.qfrc_bias()[1].abs();
            assert!((torque_nm / expected_nm - 1.0).abs() < 0.005, "{torque_nm}");
        }
    }

    /// Tests zero command against gravity, from the start and after a motion that changes the load.
    /// With a proportional servo alone the arm sags 6 degrees in this time.
    #[test]
    fn servos_do_not_sag() {
        for arm in [Some(arm("pa10")), Some(ArmSettings::default()), None] {
            let (mut plant, home) = plant(arm);
            let (rest, idle) = (vec![0.0; home.len()], Wrench::default());
            for speed in [0.0, 0.2] {
                for _ in 0..500 {
                    plant.step(&vec![speed; home.len()], &idle).unwrap();
                }
                for _ in 0..100 {
                    plant.step(&rest, &idle).unwrap();
                }
                let start = plant.q().to_vec();
                for _ in 0..2500 {
                    plant.step(&rest, &idle).unwrap();
                    let sag = plant.q().iter().zip(&start).map(|(q, start)| (q - start).abs());
                    let sag = sag.fold(0.0, f64::max);
                    assert!(sag < 0.1_f64.to_radians(), "{sag}");
                }
            }
        }
    }

    #[test]
    fn a_push_is_taken_up_within_a_fraction_of_a_second() {
        let (mut plant, home) = plant(Some(ArmSettings::default()));
        let push = Wrench { force_n: Vector3::new(-5.0, 0.0, 0.0), ..Default::default() };
        for _ in 0..500 {
            plant.step(&[0.0; 7], &push).unwrap();
        }
        let off = plant.q().iter().zip(&home).map(|(q, home)| (q - home).abs());
        let off = off.fold(0.0, f64::max);
        assert!(off < 0.05_f64.to_radians(), "{off}");
    }

    #[test]
    fn servos_follow_a_sine() {
        for (amplitude, arm) in
            [(0.2, Some(ArmSettings::default())), (0.2, Some(arm("pa10_a"))), (0.05, None)]
        {
            let (mut plant, home) = plant(arm);
            let mut worst: f64 = 0.0;
            for k in 0..2500 {
                let t = k as f64 * STEP_S;
                let command = amplitude * (std::f64::consts::TAU * 0.5 * t).sin();
                plant.step(&vec![command; home.len()], &Wrench::default()).unwrap();
                let error = plant.qdot().iter().map(|qdot| (qdot - command).abs());
                worst = worst.max(error.fold(0.0, f64::max));
            }
            assert!(worst < 0.03, "{worst}");
        }
    }

    /// Servos pushed beyond their torque limits do not wind up; after release the joints come to
    /// rest in place, without swinging back or chattering.
    #[test]
    fn saturated_servos_neither_wind_up_nor_chatter() {
        let twist = Vector3::new(20.0, 0.0, 0.0);
        for (force_n, torque_nm, arm) in [
            (Vector3::zeros(), twist, Some(ArmSettings::default())),
            (Vector3::new(-500.0, 200.0, 300.0), Vector3::zeros(), Some(ArmSettings::default())),
            (Vector3::new(-500.0, 200.0, 300.0), Vector3::zeros(), Some(arm("pa10_a"))),
            (Vector3::new(-500.0, 300.0, 400.0), Vector3::zeros(), None),
        ] {
            let (mut plant, home) = plant(arm);
            let rest = vec![0.0; home.len()];
            let mut most: f64 = 0.0;
            for _ in 0..25 {
                plant.step(&rest, &Wrench { force_n, torque_nm }).unwrap();
                most =
                    most.max(plant.motor_efforts().iter().fold(0.0, |most, nm| nm.abs().max(most)));
            }
            let pushed = plant.q().to_vec();
            for _ in 0..1000 {
                plant.step(&rest, &Wrench::default()).unwrap();
            }
            let moved = plant.q().iter().zip(&pushed).map(|(q, pushed)| (q - pushed).abs());
            let moved = moved.fold(0.0, f64::max);
            let speed = plant.qdot().iter().fold(0.0_f64, |most, qdot| qdot.abs().max(most));
            assert!(speed < 1e-4, "{speed}");
            assert!(moved < 0.3, "{moved}");
        }
    }

    #[test]
    fn the_mounts_sensor_feels_the_push_and_the_weight_beyond_it() {
        for arm in [Some(ArmSettings::default()), None] {
            let (mut plant, home) = plant(arm);
            let rest = vec![0.0; home.len()];
            let measure = |plant: &mut Plant, wrench: Wrench| {
                for _ in 0..1500 {
                    plant.step(&rest, &wrench).unwrap();
                }
                plant.mount_wrench()
            };
            let idle = measure(&mut plant, Wrench::default());
            let weight_w = plant.tip().rotation * idle.force_n;
            // 0.15 kg of adapter and finger.
            assert!((weight_w - Vector3::new(0.0, 0.0, -0.15 * 9.81)).norm() < 1e-3, "{weight_w}");
            let push = Wrench {
                force_n: Vector3::new(-2.0, 0.3, 0.5),
                torque_nm: Vector3::new(0.01, -0.02, 0.005),
            };
            let pushed = measure(&mut plant, push);
            assert!((pushed.force_n - idle.force_n - push.force_n).norm() < 1e-3);
            assert!((pushed.torque_nm - idle.torque_nm - push.torque_nm).norm() < 1e-3);
        }
    }

    #[test]
    fn pose_and_velocity_are_those_after_the_step() {
        let (mut plant, _) = plant(Some(arm("pa10")));
        let chain = arm("pa10").chain().unwrap();
        for _ in 0..200 {
            plant.step(&[0.1, -0.1, 0.2, 0.1, -0.3, 0.2, 0.1], &Wrench::default()).unwrap();
        }
        let (x, jacobian) = chain.jacobian(&chain.joints_from(plant.q()).unwrap());
        assert!((plant.tip().translation.vector - x.translation.vector).norm() < 1e-9);
        assert!(plant.tip().rotation.angle_to(&x.rotation) < 1e-7);
        let twist: Vector6<f64> = jacobian * chain.joints_from(plant.qdot()).unwrap();
        assert!((plant.tip_twist() - twist).norm() < 1e-9);
        assert!((plant.time_s() - 0.4).abs() < 1e-12);
    }

    #[test]
    fn divergence_is_a_fault_and_not_a_reset() {
        let (mut plant, home) = plant(Some(ArmSettings::default()));
        let absurd = Wrench { force_n: Vector3::new(1e14, 0.0, 0.0), ..Default::default() };
        let fault = (0..100).find_map(|_| plant.step(&[0.0; 7], &absurd).err()).unwrap();
        let Fault::Diverged { time_s, state } = &fault else { panic!("{fault}") };
        assert!(*time_s > 0.0);
        assert_eq!(state.len(), 14);
        // MuJoCo's reset would set the velocities to zero.
        assert!(state[7..].iter().any(|speed| !speed.is_finite() || speed.abs() > 1.0));
        assert!(plant.step(&[0.0; 7], &Wrench::default()).is_err());
        plant.reset(&home).unwrap();
        plant.step(&[0.0; 7], &Wrench::default()).unwrap();
        assert!(!std::path::Path::new("MUJOCO_LOG.TXT").exists());
    }

    #[test]
    fn nonsense_is_refused() {
        let (mut plant, _) = plant(Some(ArmSettings::default()));
        let nan = Wrench { force_n: Vector3::new(f64::NAN, 0.0, 0.0), ..Default::default() };
        assert!(matches!(plant.step(&[0.0; 7], &nan), Err(Fault::Refused { .. })));
        assert!(plant.step(&[0.0; 6], &Wrench::default()).is_err());
        assert!(plant.step(&[f64::INFINITY; 7], &Wrench::default()).is_err());
        assert!(plant.reset(&[f64::NAN; 7]).is_err());
        let empty = compile("<mujoco/>").unwrap();
        assert!(Plant::new(Arc::new(empty)).is_err());
    }

    #[test]
    fn the_same_inputs_give_the_same_bits() {
        let environment = environment(Some(ArmSettings::default()));
        let model = Arc::new(model(&environment));
        let home = ArmSettings::default().chain().unwrap().home;
        let run = || {
            let mut plant = Plant::new(Arc::clone(&model)).unwrap();
            plant.reset(&home.as_slice()[..7]).unwrap();
            for k in 0..1000 {
                let speed = 0.1 * (k as f64 * 0.01).sin();
                let force_n = Vector3::new(-(k as f64 * 0.003).sin(), 0.0, 0.0);
                plant.step(&[speed; 7], &Wrench { force_n, ..Default::default() }).unwrap();
            }
            let state = plant.q().iter().chain(plant.qdot());
            state.map(|value| value.to_bits()).collect::<Vec<_>>()
        };
        let (first, threads) = (run(), [0; 2].map(|_| ()));
        std::thread::scope(|scope| {
            for thread in threads.map(|()| scope.spawn(run)) {
                assert_eq!(first, thread.join().unwrap());
            }
        });
        // Another trial on the same data is independent of the previous one.
        let mut plant = Plant::new(Arc::clone(&model)).unwrap();
        for _ in 0..2 {
            plant.reset(&home.as_slice()[..7]).unwrap();
            for k in 0..1000 {
                let speed = 0.1 * (k as f64 * 0.01).sin();
                let force_n = Vector3::new(-(k as f64 * 0.003).sin(), 0.0, 0.0);
                plant.step(&[speed; 7], &Wrench { force_n, ..Default::default() }).unwrap();
            }
            let state = plant.q().iter().chain(plant.qdot()).map(|value| value.to_bits());
            assert!(state.eq(first.iter().copied()));
        }
    }

    #[test]
    fn a_finger_without_length_and_any_attitude_compiles() {
        let mut bare = palpate::sim::Scene::load(
            &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml"),
            &["finger.length_m=0".into(), "finger.pitch_deg=-90".into()],
        )
        .unwrap();
        for arm in [None, Some(ArmSettings::default())] {
            bare.arm = arm;
            let environment = Environment::build(bare.clone()).unwrap();
            let chain = environment.chain().unwrap();
            let data = MjData::new(Box::new(model(&environment)));
            assert_eq!(data.qpos().len(), chain.joints.len());
            assert!(compile(&mjcf::scene(&environment, ModelPurpose::Picture).unwrap()).is_ok());
        }
    }
}
