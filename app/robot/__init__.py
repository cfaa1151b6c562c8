"""The simulated arm: physics, kinematics, grasp targets, outcomes."""
