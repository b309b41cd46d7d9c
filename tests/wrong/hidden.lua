-- expect: 5: rd.modle: unknown function, the nearest known one is "model"
local rd = require "refdyn"
local list = __at(123456, {})
list.name = "x"
local m = rd.modle { __at(-1, list) }
