-- expect: 3: more than 32 tables nested in each other
local rd = require "refdyn"
local t = {}
t[1] = t
return rd.model { name = "wrong", links = t }
