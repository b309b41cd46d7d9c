-- expect: 3: require: "require_itself" requires itself, by way of others or at once
local rd = require "refdyn"
local parts = require "require_itself"
