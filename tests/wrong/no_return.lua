-- expect: 0: the file returns nothing; must return rd.model { ... }
local rd = require "refdyn"
rd.model { name = "wrong", links = { { "a", joint = { "x" }, mass = 1 } } }
