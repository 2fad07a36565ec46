"""The benchmark of `found`: is a goal of probability p right in a share p of queries, also where nothing is right?"""
