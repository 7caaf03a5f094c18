"""ros2 launch edge_classify_ros classify.launch.py model:=model.onnx skin:=skin.toml"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "model": ("", "the model file, model.onnx"),
    "skin": ("", "the file that describes the skin"),
    "fake": ("", "a recording to play onto fake chips instead of reading the skin"),
    "error": ("0.0", "decide as soon as labels are wrong at most this often; 0 waits"),
    "frame_id": ("forearm_skin", "the frame of the messages"),
    "joint_states": ("/joint_states", "the topic of the arm's joint angles"),
}


def generate_launch_description():
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=what)
        for name, (default, what) in ARGUMENTS.items()
    ]
    values = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    topics = [("joint_states", values.pop("joint_states"))]
    # Without a type, ROS would read `error:=0` as a whole number.
    kinds = {name: float if name == "error" else str for name in values}
    parameters = {
        name: ParameterValue(value, value_type=kinds[name])
        for name, value in values.items()
    }
    node = Node(
        package="edge_classify_ros",
        executable="classify",
        name="edge_classify",
        parameters=[parameters],
        remappings=topics,
        output="screen",
    )
    return LaunchDescription([*declared, node])
