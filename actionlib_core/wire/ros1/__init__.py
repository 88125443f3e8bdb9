"""The bridge to ROS 1 robots: a ROS 1 node of the standard library's parts, and what it carries.

Pure: `frames` (the bytes of TCPROS), `answers` (those of the XML-RPC interfaces), `publishers` (who
publishes on a topic, from answers and updates that may overtake each other), `goals` (the goals of
an action on their way). Shells: `links` (one connection each), `node` (a ROS 1 node), `topics`,
`services`, `actions` (one name each), `bridge` (which names, and when).

Source:
    https://wiki.ros.org/ROS/TCPROS, https://wiki.ros.org/ROS/Connection%20Header,
    https://wiki.ros.org/ROS/Master_API and https://wiki.ros.org/ROS/Slave_API.
"""
