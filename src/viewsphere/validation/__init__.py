"""What is wrong with given values, in the words of users: messages, suggestions, mistakes in the specs of plug-ins."""
