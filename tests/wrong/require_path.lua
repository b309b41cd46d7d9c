-- expect: 3: require: only "refdyn" and files beside the model, by their names without .lua, can be required
local rd = require "refdyn"
local parts = require "../parts"
