"""The benchmark of rooms: are the rooms that a map lists those that there are, named rightly and of the right size?"""
