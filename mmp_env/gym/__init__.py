"""The Gymnasium environment `MultiArmCell`: spaces, observation, reward, instances and registration."""
