//! Domain, network interfaces and discovery of ROS 2, from settings or from the ROS environment.

use super::settings::{DOMAIN_MAX, RosSettings};
use std::net::{IpAddr, Ipv4Addr};

/// Returns the DDS domain and the addresses of the interfaces for multicast and announcements
/// (`None` for all), from `settings`, the environment variables returned by `variable`, and the
/// `interfaces` of this machine with their IPv4 addresses. Settings have priority over variables:
/// `ROS_DOMAIN_ID`, `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE`, as in REP 2003 and
/// the documentation of ROS 2.
///
/// # Errors
/// If a variable has an invalid value, or an interface does not exist, as a message.
pub fn network(
    settings: &RosSettings,
    variable: impl Fn(&str) -> Option<String>,
    interfaces: &[(String, Vec<IpAddr>)],
) -> Result<(u16, Option<Vec<IpAddr>>), String> {
    let variable = |name: &str| variable(name).filter(|value| !value.trim().is_empty());
    let domain = match (settings.domain, variable("ROS_DOMAIN_ID")) {
        (Some(domain), _) => domain,
        (None, None) => 0,
        (None, Some(text)) => {
            let domain = text.trim().parse().ok().filter(|&domain| domain <= DOMAIN_MAX);
            domain.ok_or_else(|| {
                format!("ROS_DOMAIN_ID is {text:?}; allowed are 0 to {DOMAIN_MAX}")
            })?
        }
    };
    if !settings.interfaces.is_empty() {
        let named = settings.interfaces.iter().map(|wanted| find(wanted, interfaces));
        let addresses: Vec<_> = named.collect::<Result<_, _>>()?;
        return Ok((domain, Some(addresses.concat())));
    }
    let local_only = match variable("ROS_LOCALHOST_ONLY").as_deref().map(str::trim) {
        None | Some("0") => false,
        Some("1") => true,
        Some(other) => {
            return Err(format!("ROS_LOCALHOST_ONLY is {other:?}; allowed are 0, 1"));
        }
    };
    let range = variable("ROS_AUTOMATIC_DISCOVERY_RANGE").map(|text| text.trim().to_uppercase());
    let is_local = match range.as_deref() {
        None | Some("SUBNET" | "SYSTEM_DEFAULT") => local_only,
        Some("LOCALHOST") => true,
        // OFF: without discovery no arm is found.
        other => {
            let other = other.unwrap_or_default();
            return Err(format!(
                "ROS_AUTOMATIC_DISCOVERY_RANGE is {other:?}; allowed are LOCALHOST, SUBNET, \
                 SYSTEM_DEFAULT; or name interfaces in backend.ros2.interfaces"
            ));
        }
    };
    Ok((domain, is_local.then(|| vec![Ipv4Addr::LOCALHOST.into()])))
}

/// Largest number of characters of a variable's value in a note.
const VALUE_MAX: usize = 60;

/// Remedy of a file of a DDS vendor, which may list peers and interfaces.
const FILE_REMEDY: &str = "Palpate does not read this file. Name its interfaces in backend.ros2.interfaces. If it lists peers or forbids \
                           multicast, list this computer in the driver's file.";

/// Environment variables of ROS 2 and of DDS vendors that Palpate does not support, with remedies.
const UNSUPPORTED: [(&str, &str); 7] = [
    (
        "RMW_IMPLEMENTATION",
        "Palpate uses DDS. Start the driver with RMW_IMPLEMENTATION=rmw_fastrtps_cpp or rmw_cyclonedds_cpp.",
    ),
    (
        "ROS_STATIC_PEERS",
        "Palpate finds other computers by multicast. Put both in one subnet, or list this computer in \
         ROS_STATIC_PEERS of the driver. If discovery is limited to LOCALHOST, also name the interface in \
         backend.ros2.interfaces.",
    ),
    ("ROS_DISCOVERY_SERVER", "Palpate uses no discovery server. Start the driver without one."),
    ("FASTRTPS_DEFAULT_PROFILES_FILE", FILE_REMEDY),
    ("FASTDDS_DEFAULT_PROFILES_FILE", FILE_REMEDY),
    ("CYCLONEDDS_URI", FILE_REMEDY),
    (
        "ROS_SECURITY_ENABLE",
        "Palpate has no DDS security. Start the driver with ROS_SECURITY_ENABLE=false.",
    ),
];

/// Whether a variable of [`UNSUPPORTED`] has a value that changes nothing.
fn is_supported(name: &str, value: &str) -> bool {
    match name {
        "RMW_IMPLEMENTATION" => ["fastrtps", "dds"].iter().any(|dds| value.contains(dds)),
        "ROS_SECURITY_ENABLE" => value != "true",
        _ => false,
    }
}

/// Returns a note on the environment variables that are set and that Palpate does not support, with
/// their values, as returned by `variable`, and the remedies; `None` without any.
///
/// They are no error of [`network`], because they need not keep the arm from being found.
pub fn discovery_note(variable: impl Fn(&str) -> Option<String>) -> Option<String> {
    let notes = UNSUPPORTED.iter().filter_map(|(name, remedy)| {
        let value = variable(name)?;
        let value = value.trim();
        let shown: String = value.chars().take(VALUE_MAX).collect();
        let is_noted = !value.is_empty() && !is_supported(name, value);
        is_noted.then(|| format!("{name} is {shown:?}: {remedy}"))
    });
    let notes: Vec<String> = notes.collect();
    (!notes.is_empty()).then(|| notes.join(" "))
}

/// Returns the addresses of the interface with this name or address.
fn find(wanted: &str, interfaces: &[(String, Vec<IpAddr>)]) -> Result<Vec<IpAddr>, String> {
    let address: Option<IpAddr> = wanted.parse().ok();
    let connected = interfaces.iter().filter(|(_, addresses)| !addresses.is_empty());
    let found = connected.clone().find(|(name, addresses)| {
        name == wanted || address.is_some_and(|address| addresses.contains(&address))
    });
    match (found, address) {
        (Some(_), Some(address)) => Ok(vec![address]),
        (Some((_, addresses)), None) => Ok(addresses.clone()),
        (None, _) => {
            let known: Vec<&str> = connected.map(|(name, _)| name.as_str()).collect();
            Err(format!(
                "backend.ros2.interfaces: {wanted:?} is not an interface with an IPv4 address on this machine; allowed are {}",
                known.join(", ")
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine() -> Vec<(String, Vec<IpAddr>)> {
        let interface = |name: &str, addresses: &[[u8; 4]]| {
            (name.into(), addresses.iter().map(|&address| IpAddr::from(address)).collect())
        };
        vec![
            interface("lo", &[[127, 0, 0, 1]]),
            interface("eth0", &[[10, 0, 0, 2], [10, 0, 0, 3]]),
            interface("eth1", &[]),
        ]
    }

    type Found = Result<(u16, Option<Vec<IpAddr>>), String>;

    fn read(settings: &str, variables: &[(&str, &str)]) -> Found {
        let settings: RosSettings = toml::from_str(settings).unwrap();
        let variable = |name: &str| {
            let found = variables.iter().find(|(other, _)| *other == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        network(&settings, variable, &machine())
    }

    #[test]
    fn the_environment_of_ros_is_honoured_where_settings_say_nothing() {
        let all = |domain| Ok((domain, None));
        let local = Some(vec![IpAddr::from([127, 0, 0, 1])]);
        assert_eq!(read("", &[]), all(0));
        assert_eq!(read("", &[("ROS_DOMAIN_ID", "7")]), all(7));
        assert_eq!(read("domain = 0", &[("ROS_DOMAIN_ID", "7")]), all(0));
        for variables in
            [[("ROS_LOCALHOST_ONLY", "1")], [("ROS_AUTOMATIC_DISCOVERY_RANGE", "localhost")]]
        {
            assert_eq!(read("", &variables).unwrap().1, local, "{variables:?}");
            let named = read("interfaces = [\"eth0\"]", &variables).unwrap().1;
            assert_eq!(named.unwrap().len(), 2);
        }
        let variables = [("ROS_LOCALHOST_ONLY", "0"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")];
        assert_eq!(read("", &variables), all(0));
        let one = read("interfaces = [\"10.0.0.3\"]", &[]).unwrap().1;
        assert_eq!(one, Some(vec![IpAddr::from([10, 0, 0, 3])]));
    }

    #[test]
    fn variables_that_are_not_supported_are_named_with_a_remedy() {
        let note = |variables: &[(&str, &str)]| {
            discovery_note(|name| {
                let found = variables.iter().find(|(other, _)| *other == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        for (name, value, says) in [
            ("ROS_STATIC_PEERS", "10.0.0.7;arm.local", "one subnet"),
            ("ROS_DISCOVERY_SERVER", "10.0.0.7:11811", "without one"),
            ("RMW_IMPLEMENTATION", "rmw_zenoh_cpp", "rmw_fastrtps_cpp or rmw_cyclonedds_cpp"),
            ("CYCLONEDDS_URI", "file:///etc/cyclone.xml", "backend.ros2.interfaces"),
            ("FASTRTPS_DEFAULT_PROFILES_FILE", "fast.xml", "list this computer"),
            ("FASTDDS_DEFAULT_PROFILES_FILE", "fast.xml", "list this computer"),
            ("ROS_SECURITY_ENABLE", "true", "ROS_SECURITY_ENABLE=false"),
        ] {
            let found = note(&[(name, value)]).unwrap();
            assert!(found.starts_with(&format!("{name} is {value:?}: ")), "{found}");
            assert!(found.contains(says) && found.ends_with('.'), "{found}");
            // No variable keeps Palpate from a network in which the arm may be found.
            assert!(read("", &[(name, value)]).is_ok(), "{name}");
        }
        for supported in [
            ("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp"),
            ("RMW_IMPLEMENTATION", "rmw_fastrtps_dynamic_cpp"),
            ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"),
            ("RMW_IMPLEMENTATION", "rmw_connextdds"),
            ("ROS_STATIC_PEERS", " "),
            ("ROS_SECURITY_ENABLE", "false"),
            ("ROS_DOMAIN_ID", "7"),
        ] {
            assert_eq!(note(&[supported]), None, "{supported:?}");
        }
        assert_eq!(note(&[]), None);
        let both = note(&[("CYCLONEDDS_URI", &"<x/>".repeat(99)), ("ROS_STATIC_PEERS", "a")]);
        let both = both.unwrap();
        assert!(both.contains("ROS_STATIC_PEERS is \"a\"") && both.contains(". CYCLONEDDS_URI"));
        assert!(both.len() < 600, "{both}");
    }

    #[test]
    fn what_is_not_allowed_is_named_with_its_value() {
        let cases = [
            ("", ("ROS_DOMAIN_ID", "233"), "ROS_DOMAIN_ID is \"233\""),
            ("", ("ROS_DOMAIN_ID", "lab"), "allowed are 0 to 232"),
            ("", ("ROS_LOCALHOST_ONLY", "yes"), "ROS_LOCALHOST_ONLY is \"yes\""),
            ("", ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"), "is \"OFF\""),
            ("interfaces = [\"wlan0\"]", ("A", "b"), "\"wlan0\" is not an interface"),
            ("interfaces = [\"eth1\"]", ("A", "b"), "allowed are lo, eth0"),
            ("interfaces = [\"10.0.0.9\"]", ("A", "b"), "10.0.0.9"),
        ];
        for (settings, variable, says) in cases {
            let error = read(settings, &[variable]).unwrap_err();
            assert!(error.contains(says), "{error}: {says}");
        }
    }
}
