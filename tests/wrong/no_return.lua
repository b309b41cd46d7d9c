-- expect: 0: the file returns nothing, return rd.model { ... } is needed
local rd = require "refdyn"
rd.model { name = "wrong", links = { { "a", joint = { "x" }, mass = 1 } } }
