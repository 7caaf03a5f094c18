from setuptools import setup

NAME = "edge_classify_ros"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", ["launch/classify.launch.py"]),
    ],
    install_requires=["setuptools", "edge-classify"],
    license="BSD-3-Clause",
    entry_points={"console_scripts": [f"classify = {NAME}.node:main"]},
)
