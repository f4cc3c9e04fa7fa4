"""A planning node for ROS 2: occupancy grids and poses in, paths out.

    python examples/nav_msgs_node.py

It subscribes to nav_msgs/OccupancyGrid on /map and to geometry_msgs/PoseStamped on /start and
/goal_pose, plans ten times a second from the newest start, and publishes nav_msgs/Path on /plan.
Without ROS it plans once on a message of the same form, and prints the path. The functions that
translate messages need no ROS at all.
"""

from __future__ import annotations

from math import atan2, cos, sin
from types import SimpleNamespace
from typing import Any

from cbagan_ompl import CbaganOmplError, GridMap, Replanner

try:
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from nav_msgs.msg import OccupancyGrid, Path
    from rosidl_runtime_py.set_message import set_message_fields
except ImportError:
    rclpy = None

RADIUS = 0.2


def yaw_of(orientation: Any) -> float:
    """Return the heading of a quaternion, radians."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def grid_of(message: Any) -> GridMap:
    """Return the map of a nav_msgs/OccupancyGrid."""
    info = message.info
    corner = info.origin.position
    return GridMap.from_occupancy_grid(
        message.data,
        info.width,
        info.height,
        info.resolution,
        (corner.x, corner.y, yaw_of(info.origin.orientation)),
        name="map",
    )


def path_message(path: Any, frame: str = "map") -> dict[str, Any]:
    """Return positions (N, 2) or poses (N, 3) with the fields of a nav_msgs/Path.

    Positions have the heading of the segment that leaves them; the last one, that which ends there.
    """
    poses = []
    for number, point in enumerate(path):
        if len(point) == 3:
            yaw = point[2]
        else:
            first = max(min(number, len(path) - 2), 0)
            (x0, y0), (x1, y1) = path[first], path[min(first + 1, len(path) - 1)]
            yaw = atan2(y1 - y0, x1 - x0)
        pose = {
            "position": {"x": float(point[0]), "y": float(point[1]), "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": sin(yaw / 2), "w": cos(yaw / 2)},
        }
        poses.append({"header": {"frame_id": frame}, "pose": pose})
    return {"header": {"frame_id": frame}, "poses": poses}


def spin() -> None:
    """Run the node."""
    rclpy.init()
    node = rclpy.create_node("cbagan_ompl")
    newest: dict[str, Any] = {}
    publisher = node.create_publisher(Path, "plan", 1)

    def take_map(message: Any) -> None:
        newest["grid"] = grid_of(message)

    def take_start(message: Any) -> None:
        newest["start"] = message.pose.position.x, message.pose.position.y

    def take_goal(message: Any) -> None:
        if "grid" in newest:
            goal = message.pose.position.x, message.pose.position.y
            options = {"radius": RADIUS, "snap": RADIUS, "time": 0.08}
            newest["replanner"] = Replanner(newest["grid"], goal, **options)

    def cycle() -> None:
        if not {"grid", "start", "replanner"} <= newest.keys():
            return
        try:
            result = newest["replanner"].plan(newest["start"], newest["grid"])
        except CbaganOmplError as error:
            node.get_logger().warning(str(error))
            return
        if result.solved:
            message = Path()
            set_message_fields(message, path_message(result.path))
            message.header.stamp = node.get_clock().now().to_msg()
            publisher.publish(message)

    node.create_subscription(OccupancyGrid, "map", take_map, 1)
    node.create_subscription(PoseStamped, "start", take_start, 1)
    node.create_subscription(PoseStamped, "goal_pose", take_goal, 1)
    node.create_timer(0.1, cycle)
    rclpy.spin(node)


def fake_grid() -> Any:
    """Return a message of 6 m x 4 m with a wall: 100 occupied, 0 free, -1 unknown."""
    width, height = 120, 80
    wall = {(column, row) for column in range(58, 62) for row in range(55)}
    data = [100 if (n % width, n // width) in wall else 0 for n in range(width * height)]
    data[-width:] = [-1] * width
    origin = SimpleNamespace(
        position=SimpleNamespace(x=-1.0, y=-1.0, z=0.0),
        orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0),
    )
    info = SimpleNamespace(width=width, height=height, resolution=0.05, origin=origin)
    return SimpleNamespace(info=info, data=data)


def main() -> None:
    if rclpy is not None:
        spin()
        return
    print("no ROS here: a plan on a message of our own")
    replanner = Replanner(grid_of(fake_grid()), (4.5, 0.0), radius=RADIUS, time=1.0, seed=1)
    result = replanner.plan((-0.5, 0.0))
    assert result.solved, result.status
    for stamped in path_message(result.path)["poses"]:
        position = stamped["pose"]["position"]
        print(f"  {position['x']:6.2f} {position['y']:6.2f}")


if __name__ == "__main__":
    main()
