"""The wire of ROS 2 nodes whose middleware is rmw_zenoh: keys, tokens, attachments, actions."""
